#include "analysis/check/check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <utility>

#include "tests/analysis/check/planted.h"
#include "tests/analysis/synthetic.h"
#include "tests/blind/recording.h"

namespace emtb {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::Each;
using testing::Field;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

auto names(Flaw what, std::optional<Signal> signal) {
  return Contains(AllOf(Field("what", &DataFinding::what, what), Field("signal", &DataFinding::signal, signal)));
}
auto is_a(Flaw what) { return Field("what", &DataFinding::what, what); }

/// A servo with speed, voltage and current, and a bench whose current a slow meter reads.
class Check : public testing::Test {
 protected:
  using Run = emtb::Run;  // not testing::Test::Run

  static std::vector<Run> servo_runs() { return record(blind::fast_bench(), blind::fast_bench().train, 3); }
  static std::vector<Run> slow_runs() { return record(blind::slow_bench(), blind::slow_bench().train, 3); }

  const Model servo = blind::fast_bench().model;
  const Model slow = blind::slow_bench().model;
};

TEST_F(Check, FindsNothingInGoodRecordings) {
  EXPECT_THAT(check(servo_runs(), {}, &servo), IsEmpty());
  EXPECT_THAT(check(slow_runs(), {}, &slow), IsEmpty());
}

TEST_F(Check, RemarksOnceThatNothingFixesTheScaleWithoutAModel) {
  const DataFindings found = check(servo_runs());
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].what, Flaw::scale);
  EXPECT_FALSE(found[0].stops);
}

TEST_F(Check, TheModelsBoundsContradictMilliamperesAndRevolutions) {
  auto mA = servo_runs();
  for (Run& run : mA) planted::scale(run, Signal::i_a, 1000);
  EXPECT_THAT(check(mA, {}, &servo), names(Flaw::scale, Signal::i_a));
  EXPECT_TRUE(check(mA, {}, &servo).front().by_bounds);
  auto rpm = slow_runs();
  for (Run& run : rpm) planted::scale(run, Signal::omega, 9.5493);
  const DataFindings found = check(rpm, {}, &slow);
  EXPECT_THAT(found, names(Flaw::scale, Signal::omega));
  EXPECT_TRUE(stops(found));
}

TEST_F(Check, AnAngleBesideTheSpeedFixesItsScaleAndSign) {
  auto good = servo_runs();
  for (Run& run : good) planted::add_angle(run, 2000);
  EXPECT_THAT(check(good, {}, &servo), IsEmpty());
  for (const double factor : {9.5493, 57.2958, 1 / 6.28319, 1000.0, -1.0}) {
    auto wrong = good;
    for (Run& run : wrong) planted::scale(run, Signal::omega, factor);
    EXPECT_THAT(check(wrong), names(factor < 0 ? Flaw::sign : Flaw::scale, Signal::omega)) << factor;
  }
  auto degrees = good;
  for (Run& run : degrees) planted::scale(run, Signal::theta, 57.2958);
  EXPECT_THAT(check(degrees), names(Flaw::scale, Signal::theta));
}

TEST_F(Check, AnAngleThatIsAnotherMotionIsNoScale) {
  auto runs = servo_runs();
  for (Run& run : runs) planted::add_angle(run, 2000);
  for (double& angle : runs[0].signals.at(Signal::theta).value.edit()) angle = std::fmod(angle, 6.283185307179586);
  EXPECT_THAT(check(runs, {}, &servo), names(Flaw::angle_speed, Signal::theta)) << "the angle wraps";
}

TEST_F(Check, ALateSpeedIsADelayAndDoesNotStop) {
  auto runs = servo_runs();
  for (Run& run : runs) planted::add_angle(run, 2000);
  for (Run& run : runs) planted::delay(run, Signal::omega, 80);
  const DataFindings found = check(runs, {}, &servo);
  EXPECT_THAT(found, names(Flaw::delay, Signal::omega));
  EXPECT_THAT(found, Contains(Field(&DataFinding::text, HasSubstr("0.08 s"))));
  EXPECT_FALSE(stops(found));
}

TEST_F(Check, PowerTellsWhichSignalIsTurned) {
  for (const Signal signal : {Signal::omega, Signal::i_a, Signal::e_a}) {
    for (const bool meter : {false, true}) {
      auto runs = meter ? slow_runs() : servo_runs();
      for (Run& run : runs) planted::scale(run, signal, -1);
      const DataFindings found = check(runs, {}, meter ? &slow : &servo);
      EXPECT_THAT(found, names(Flaw::sign, signal)) << info(signal).name << (meter ? ", slow meter" : "");
      EXPECT_TRUE(stops(found));
      EXPECT_THAT(found, Each(is_a(Flaw::sign)));
    }
  }
}

TEST_F(Check, ABrakesTorqueAndAVoltageUnderAReferenceThatStaysMayStay) {
  // A coarse gauge shows one step while the reference is reversed, and the driver is quiet at its limit.
  Run run;
  run.name = "reversed";
  synthetic::Noise noise(3);
  Series &u_ref = run.signals[Signal::u_ref], &e_a = run.signals[Signal::e_a], &omega = run.signals[Signal::omega],
         &torque = run.signals[Signal::torque];
  double speed = 0;
  for (int k = 0; k < 2000; ++k) {
    const double t = 1e-3 * k;
    const bool limit = k % 1000 >= 750;
    const double u = limit ? -6 : 3 + noise(0.05);
    speed += 0.004 * ((limit ? -150 : 75) - speed);
    for (Series* s : {&u_ref, &e_a, &omega, &torque}) s->t.push_back(t);
    u_ref.value.push_back(u);
    e_a.value.push_back(0.0129 * std::round((limit ? -15.7 : 2.6 * u + noise(0.02)) / 0.0129));
    omega.value.push_back(speed + noise(0.5));
    torque.value.push_back(speed > 0 ? 0.5 * std::round(std::min(49.0, 100 * t)) : -24.5);
  }
  EXPECT_THAT(check(std::vector{run}), Not(Contains(is_a(Flaw::held))));
}

TEST_F(Check, AWeightThatIsLetDownTurnsNoSign) {
  // The voltage holds back what pulls the shaft backwards: the more it holds, the slower.
  Run run;
  run.name = "hoist";
  synthetic::Noise noise(3);
  constexpr double R = 5, K = 0.5, J = 0.02, load = 1, interval = 0.01;
  Series &e_a = run.signals[Signal::e_a], &i_a = run.signals[Signal::i_a], &omega = run.signals[Signal::omega];
  double speed = 0;
  for (int k = 0; k < 1500; ++k) {
    const double t = interval * k, e = t < 1 ? 10 : 4 + 2 * std::sin(1.1 * t), i = (e - K * speed) / R;
    for (Series* s : {&e_a, &i_a, &omega}) s->t.push_back(t);
    e_a.value.push_back(e + noise(0.02));
    i_a.value.push_back(i + noise(0.01));
    omega.value.push_back(speed + noise(0.05));
    if (t >= 1) speed += interval * (K * i - load) / J;
  }
  EXPECT_THAT(check(std::vector{run}), Not(Contains(is_a(Flaw::sign))));
}

TEST_F(Check, ASensorThatFreezesIsHeldAndACoarseOneIsNot) {
  auto runs = servo_runs();
  ASSERT_TRUE(planted::hold(runs[0], Signal::omega, 200));
  EXPECT_THAT(check(runs, {}, &servo), names(Flaw::held, Signal::omega));
  auto coarse = servo_runs();
  for (Run& run : coarse) {
    Series& omega = run.signals.at(Signal::omega);
    omega.lsb = 5;
    for (double& v : omega.value.edit()) v = 5 * std::round(v / 5);
  }
  EXPECT_THAT(check(coarse, {}, &servo), IsEmpty());
}

TEST_F(Check, FrictionMayTakeNearlyAllOfTheTorqueBeforeItsGauge) {
  for (const double share : {0.05, 20.0}) {
    std::vector<Run> runs = servo_runs();
    for (Run& run : runs) {
      Series torque = run.at(Signal::i_a);
      for (double& v : torque.value.edit()) v *= 0.042 * share;
      torque.lsb *= 0.042 * share;
      run.signals[Signal::torque] = torque;
    }
    const DataFindings found = check(runs, {}, &servo);
    const bool named = std::ranges::any_of(
        found, [](const DataFinding& f) { return f.what == Flaw::scale && f.signal == Signal::torque; });
    EXPECT_EQ(named, share > 1) << "no motor makes more than its current tells";
  }
}

TEST_F(Check, AnAngleThatStandsWithoutPowerIsNotHeld) {
  // The reference goes back to nothing at 4 s; the tachogenerator stays where its coupling stuck.
  const auto run_with = [](double power_after) {
    Run run;
    run.name = "stuck";
    synthetic::Noise noise(3);
    run.signals[Signal::u_ref] = synthetic::series(0.02, 8, [&](double t) { return t < 4 ? 4.0 : power_after; });
    run.signals[Signal::omega] = synthetic::series(0.02, 8, [&](double t) { return (t < 4 ? 8 : 2) + noise(0.02); });
    run.signals[Signal::theta] =
        synthetic::series(0.02, 8, [](double t) { return 0.01 * std::floor(std::min(8 * t, 32.0) / 0.01); });
    return std::vector{run};
  };
  EXPECT_THAT(check(run_with(0)), Not(names(Flaw::held, Signal::theta)));
  EXPECT_THAT(check(run_with(1)), names(Flaw::held, Signal::theta));
}

TEST_F(Check, ABrakesTorqueThatLetsGoForOneReadingIsNoSpikeWhereTheAngleStands) {
  const auto braked = [](double turns_until) {
    Run run;
    run.name = "braked";
    synthetic::Noise noise(3);
    run.signals[Signal::e_a] = synthetic::series(0.02, 10, [&](double) { return 6 + noise(0.02); });
    run.signals[Signal::theta] =
        synthetic::series(0.02, 10, [&](double t) { return 5 * std::min(t, turns_until) + noise(0.004); });
    run.signals[Signal::torque] =
        synthetic::series(0.02, 10, [&](double t) { return std::abs(t - 8) < 0.005 ? 7.0 : 18 + noise(0.03); });
    return std::vector{run};
  };
  EXPECT_THAT(check(braked(6)), Not(names(Flaw::spikes, Signal::torque)));
  EXPECT_THAT(check(braked(10)), names(Flaw::spikes, Signal::torque));
}

TEST_F(Check, ASignalThatRepeatsItselfIsARemark) {
  auto runs = servo_runs();
  for (Run& run : runs) {
    const std::span<double> x = run.signals.at(Signal::i_a).value.edit();
    for (std::size_t k = 0; k < x.size(); ++k) x[k] = x[k - k % 10];
  }
  const DataFindings found = check(runs, {}, &servo);
  EXPECT_THAT(found, names(Flaw::held, Signal::i_a));
  EXPECT_FALSE(stops(found));
}

TEST_F(Check, ASignalBeyondItsRangeIsClipped) {
  auto runs = servo_runs();
  planted::clip(runs[1], Signal::omega, 0.7);
  const DataFindings found = check(runs, {}, &servo);
  EXPECT_THAT(found, names(Flaw::clipped, Signal::omega));
  EXPECT_THAT(found, Not(Contains(is_a(Flaw::held))));
  EXPECT_TRUE(stops(found));
}

/// A speed controller sends the driver to and fro, and to its highest reference for as long as the motor speeds up.
emtb::Run in_closed_loop() {
  emtb::Run run;
  run.name = "step.h5";
  const std::vector<double> noise = synthetic::coloured(600, 0.5, 7);
  for (std::size_t k = 0; k < noise.size(); ++k) {
    const double t = 0.002 * static_cast<double>(k);  // [s]
    const bool speeding_up = k >= 100 && k < 150;
    const double u = speeding_up ? 1 : k < 50 ? 0 : 0.5 + 0.02 * noise[k];
    for (const auto& [signal, value] :
         {std::pair{Signal::u_ref, u}, std::pair{Signal::e_a, 0.2 * std::round(5 * 96 * u)},
          std::pair{Signal::omega, 150 * std::clamp(t / 0.3, 0.0, 1.0) + noise[k]}}) {
      run.signals[signal].t.push_back(t);
      run.signals[signal].value.push_back(value);
    }
  }
  return run;
}

TEST_F(Check, AVoltageStaysWhereItsReferenceStays) {
  emtb::Run run = in_closed_loop();
  EXPECT_THAT(check(std::vector{run}), Not(Contains(Field("signal", &DataFinding::signal, Signal::e_a))));
  Series& e_a = run.signals.at(Signal::e_a);
  for (std::size_t k = 300; k < 400; ++k) e_a.value.edit()[k] = e_a.value[300];
  EXPECT_THAT(check(std::vector{run}), names(Flaw::held, Signal::e_a)) << "the reference goes on";
}

TEST_F(Check, SpikesAreCountedAndAnInrushIsNone) {
  auto runs = servo_runs();
  planted::spike(runs[2], Signal::omega, 5, 1);
  const DataFindings found = check(runs, {}, &servo);
  EXPECT_THAT(found, names(Flaw::spikes, Signal::omega));
  EXPECT_THAT(found, Contains(Field(&DataFinding::text, HasSubstr("5 readings"))));
}

/// A shaft that a step of the voltage speeds up within 0.3 s, read at 50 Hz by an encoder.
Run stepped(std::initializer_list<double> first) {
  constexpr double row = 0.02, count = 0.7;
  Run run;
  run.name = "stepped";
  const auto at = [&](double t) { return t < 2 ? 0 : 11 * (1 - std::exp(-(t - 2) / 0.1)); };
  run.signals[Signal::u_ref] = synthetic::series(row, 6, [](double t) { return t < 2 ? 0.0 : 9.0; });
  run.signals[Signal::omega] = synthetic::series(row, 6, [&](double t) { return count * std::round(at(t) / count); });
  std::ranges::copy(first, run.signals[Signal::omega].value.edit().begin() + 101);
  return run;
}

TEST_F(Check, ACountOfAShaftThatHardlyTurnsIsNoSpike) {
  // A count over the time since the row before, of uneven rows: one in fifty rows at first, then three in each.
  constexpr double q = 5e-5;
  synthetic::Noise noise(5);
  Run run;
  run.name = "creeping";
  Series omega{.t = {0}, .value = {0}, .window = 0, .lsb = 0, .source = {}}, u_ref = omega;
  for (int k = 1; k < 3000; ++k) {
    const int counts = k > 1500 ? 3 + (k % 7 == 0 ? 1 : 0) : k % 50 == 0 ? 1 : 0;
    omega.t.push_back(1e-3 * k + noise(2e-5));
    omega.value.push_back(counts * q / (omega.t[omega.t.size() - 1] - omega.t[omega.t.size() - 2]));
    u_ref.value.push_back(k > 1500 ? 2 : 0);
  }
  u_ref.t = omega.t;
  run.signals = {{Signal::omega, omega}, {Signal::u_ref, u_ref}};
  EXPECT_THAT(check(std::vector{run}), Not(names(Flaw::spikes, Signal::omega)));
  run.signals.at(Signal::omega).value.edit()[2200] = 2;
  EXPECT_THAT(check(std::vector{run}), names(Flaw::spikes, Signal::omega));
}

TEST_F(Check, TheFirstReadingsOfAnEncoderThatNoShaftCanLeaveInARowAreNamed) {
  const DataFindings found = check(std::vector{stepped({16, 16.7})});
  EXPECT_THAT(found, names(Flaw::spikes, Signal::omega));
  EXPECT_THAT(found, Contains(Field(&DataFinding::text, HasSubstr("2 readings leap, 16.7 rad/s at 2.04 s"))));
  EXPECT_TRUE(stops(found));
  EXPECT_THAT(check(std::vector{stepped({})}), Not(names(Flaw::spikes, Signal::omega)));
  EXPECT_THAT(check(std::vector{stepped({9, 12, 14, 13, 11.5, 10, 9.6, 10, 11})}),
              Not(names(Flaw::spikes, Signal::omega)))
      << "an overshoot that the shaft leaves as it came";
}

TEST_F(Check, GapsAndUnevenRowsAreSaidAndDoNotStop) {
  auto holed = servo_runs();
  planted::pause(holed[0], 1.2, 100);
  const DataFindings gap = check(holed, {}, &servo);
  EXPECT_THAT(gap, names(Flaw::gap, std::nullopt));
  EXPECT_FALSE(stops(gap));
  auto uneven = servo_runs();
  planted::jitter(uneven[0], Signal::u_ref, 1, 2);
  EXPECT_THAT(check(uneven, {}, &servo), names(Flaw::jitter, std::nullopt));
}

TEST_F(Check, TheSameReadingsUnderAnotherNameCountTwice) {
  auto runs = servo_runs();
  runs.push_back(runs[0]);
  runs.back().name = "copy.csv";
  EXPECT_THAT(check(runs, {}, &servo), names(Flaw::duplicate, std::nullopt));
  auto train = servo_runs();
  const std::vector<Run> judging{train[2]};
  EXPECT_TRUE(stops(check(train, judging, &servo)));
  EXPECT_THAT(check(servo_runs(), record(blind::fast_bench(), blind::fast_bench().train, 9), &servo), IsEmpty())
      << "the same profiles, recorded again";
}

TEST_F(Check, ASpeedThatAControllerSwingsHalfASwingLaterTurnsNoSign) {
  Run run;
  run.name = "swinging";
  synthetic::Noise noise(3);
  for (int k = 0; k < 1500; ++k) {
    const double t = 0.0025 * k, on = t < 0.25 ? 0 : 1;
    run.signals[Signal::u_ref].t.push_back(t);
    run.signals[Signal::u_ref].value.push_back(on * 6 * std::sin(9 * (t - 0.25)));
    run.signals[Signal::omega].t.push_back(t);
    run.signals[Signal::omega].value.push_back(on * 10 * std::sin(9 * (t - 0.25) - 2.0) + noise(0.01));
  }
  EXPECT_THAT(check(std::vector{run}), Not(Contains(is_a(Flaw::sign))));
  run.signals.at(Signal::omega).value = run.signals.at(Signal::u_ref).value;  // a motor without inertia, turned
  for (double& omega : run.signals.at(Signal::omega).value.edit()) omega *= -2;
  EXPECT_THAT(check(std::vector{run}), names(Flaw::sign, Signal::omega));
}

TEST_F(Check, AMotorThatNeverTurnsOrADeadChannelStops) {
  auto runs = servo_runs();
  for (Run& run : runs) {
    for (double& v : run.signals.at(Signal::omega).value.edit()) v *= 1e-6;
  }
  EXPECT_THAT(check(runs, {}, &servo), names(Flaw::rest, Signal::omega));
  auto dead = servo_runs();
  for (Run& run : dead) std::ranges::fill(run.signals.at(Signal::i_a).value.edit(), 0.0);
  EXPECT_THAT(check(dead, {}, &servo), names(Flaw::rest, Signal::i_a));
  auto unwired = slow_runs();
  for (Run& run : unwired) std::ranges::fill(run.signals.at(Signal::u_ref).value.edit(), 0.0);
  EXPECT_THAT(check(unwired, {}, &slow), names(Flaw::rest, Signal::u_ref));
}

TEST_F(Check, RunsThatBeginAsAStepIsMadeHaveAVoltageThatNeverChanges) {
  const auto step_to = [](double e) {
    Run run;
    run.name = "step to " + std::to_string(e);
    run.signals[Signal::e_a] = synthetic::series(1e-2, 1, [&](double) { return e; });
    run.signals[Signal::omega] =
        synthetic::series(1e-2, 1, [&](double t) { return 20 * e * (1 - std::exp(-t / 0.1)); });
    return run;
  };
  EXPECT_THAT(check(std::vector{step_to(6), step_to(-3)}), Not(Contains(is_a(Flaw::rest))));
  EXPECT_THAT(check(std::vector{step_to(6)}), Not(Contains(is_a(Flaw::rest)))) << "one step";
  std::vector<Run> unwired{step_to(6), step_to(-3)};
  for (Run& run : unwired) std::ranges::fill(run.signals.at(Signal::e_a).value.edit(), 0.0);
  EXPECT_THAT(check(unwired), names(Flaw::rest, Signal::e_a));
  std::vector<Run> stuck{step_to(6), step_to(6)};
  for (Run& run : stuck) {
    run.signals[Signal::u_ref] = synthetic::series(1e-2, 1, [](double t) { return t < 0.5 ? 6.0 : 2.0; });
  }
  EXPECT_THAT(check(stuck), names(Flaw::rest, Signal::e_a)) << "though the reference changes";
}

TEST_F(Check, AShortRunOfFewCountsMovesWhereItsInputLeadsIt) {
  const auto counted = [](double counts) {
    Run run;
    run.name = "short";
    synthetic::Noise noise(3);
    run.signals[Signal::u_ref] = synthetic::series(4e-3, 0.56, [](double t) { return 2 + 2 * std::sin(20 * t); });
    double omega = 0;
    run.signals[Signal::omega] = synthetic::series(4e-3, 0.56, [&](double t) {
      omega += 0.1 * (counts * (1 + std::sin(20 * t)) - omega);
      return 0.016 * std::floor(omega + noise(0.5));
    });
    return std::vector{run};
  };
  EXPECT_THAT(check(counted(8), {}, nullptr), Not(names(Flaw::rest, Signal::omega)));
  EXPECT_THAT(check(counted(0), {}, nullptr), names(Flaw::rest, Signal::omega)) << "noise goes its own way";
}

TEST_F(Check, ANoisySpeedThatGoesWithItsAngleDoesNotRest) {
  const auto turning = [](double share) {  // a big machine at 40 Hz: 25 rad/s, of which a reading scatters by 0.7
    Run run;
    run.name = "big";
    synthetic::Noise noise(3);
    double omega = 0, theta = 5.8;
    run.signals[Signal::u_ref] = synthetic::series(0.025, 6, [](double t) { return t > 1 && t < 4.5 ? -0.16 : 0.0; });
    for (const Signal signal : {Signal::omega, Signal::theta}) run.signals[signal] = {};
    for (const double t : run.at(Signal::u_ref).t) {
      omega += 0.09 * ((t > 1 && t < 4.5 ? -24.0 : 0.0) - omega);
      theta += 0.025 * omega;
      run.signals[Signal::omega].t.push_back(t);
      run.signals[Signal::omega].value.push_back(0.0929 * std::round((share * omega + noise(0.7)) / 0.0929));
      run.signals[Signal::theta].t.push_back(t);
      run.signals[Signal::theta].value.push_back(0.004 * std::round(theta / 0.004));
    }
    return std::vector{run};
  };
  EXPECT_THAT(check(turning(1), {}, nullptr), Not(names(Flaw::rest, Signal::omega)));
  EXPECT_THAT(check(turning(0), {}, nullptr), names(Flaw::rest, Signal::omega)) << "noise goes its own way";
}

/// What a driver makes of a slow wave that goes from 0 to 30 V, read to 0.1 V.
DataFindings of_a_driver(double (*voltage)(int row, double reference)) {
  Run run;
  run.name = "driven";
  synthetic::Noise noise(3);
  Series &u_ref = run.signals[Signal::u_ref], &e_a = run.signals[Signal::e_a];
  for (int k = 0; k < 2400; ++k) {
    const double u = 15 + 15 * std::sin(4e-3 * k);
    for (Series* s : {&u_ref, &e_a}) s->t.push_back(5e-4 * k);
    u_ref.value.push_back(u);
    e_a.value.push_back(0.1 * std::round((voltage(k, u) + noise(0.02)) / 0.1));
  }
  return check(std::vector{run}, {}, nullptr);
}

TEST_F(Check, AVoltageThatEndsWhereItsDriverDoesIsNotHeldButForAStep) {
  const auto ends = [](int k, double u) { return std::min(u, 26.8) + (k % 97 == 0 ? 0.1 : 0); };
  const auto sticks = [](int k, double u) { return k > 600 && k < 900 ? 12.0 : u; };
  EXPECT_THAT(of_a_driver(ends), Not(Contains(is_a(Flaw::held))));
  EXPECT_THAT(of_a_driver(sticks), names(Flaw::held, Signal::e_a));
}

TEST_F(Check, AVoltageThatFollowsANoisyReferenceHasNoNoiseOfItsOwn) {
  // A speed controller: its reference goes to its limit and stays there while the motor speeds up.
  Run run;
  run.name = "controlled";
  synthetic::Noise noise(3);
  Series &u_ref = run.signals[Signal::u_ref], &e_a = run.signals[Signal::e_a];
  double e = 0;
  for (int k = 0; k < 1200; ++k) {
    for (Series* s : {&u_ref, &e_a}) s->t.push_back(4e-3 * k);
    u_ref.value.push_back(k % 200 >= 160 ? 10 : 6 + noise(0.03));
    e += std::clamp(1.2 * u_ref.value.back() - e, -0.45, 0.45);
    e_a.value.push_back(1e-3 * std::round(e / 1e-3));
  }
  EXPECT_THAT(check(std::vector{run}, {}, nullptr), Not(Contains(is_a(Flaw::clipped))));
}

TEST_F(Check, AnInstrumentOfFewStepsIsARemark) {
  auto runs = slow_runs();
  for (Run& run : runs) {
    for (double& v : run.signals.at(Signal::omega).value.edit()) v = 50 * std::round(v / 50);
    run.signals.at(Signal::omega).lsb = 50;
  }
  const DataFindings found = check(runs, {}, &slow);
  EXPECT_THAT(found, names(Flaw::resolution, Signal::omega));
  EXPECT_FALSE(stops(found));
}

}  // namespace
}  // namespace emtb
