#include "analysis/record/record.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "analysis/record/dataset.h"
#include "analysis/record/driver_voltage.h"
#include "hal/error.h"
#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

using synthetic::record;
using synthetic::series;
using synthetic::servo_model;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

const Observation* observation(const ObservedRun& run, Signal signal) {
  const auto o = std::ranges::find(run.observations, signal, &Observation::signal);
  return o == run.observations.end() ? nullptr : &*o;
}

std::string complaint_of_preparing(const emtb::Run& run, const Model& model = servo_model()) {
  try {
    observe_run(run, model);
  } catch (const ModelError& e) {
    return e.what();
  }
  return "accepted";
}

/// u_ref and omega at 1 kHz for 2 s.
emtb::Run plain_run() {
  emtb::Run run;
  run.name = "steps.csv#a";
  run.signals[Signal::u_ref] = series(1e-3, 2, [](double t) { return t < 0.5 ? 0.0 : 2.0; });
  run.signals[Signal::omega] = series(1e-3, 2, [](double t) { return t < 0.5 ? 0.0 : 180.0; });
  return run;
}

// ---- what is compared

TEST(PrepareRun, AFastReadingIsAnInstant) {
  const ObservedRun run = observe_run(plain_run(), servo_model());
  const Observation* omega = observation(run, Signal::omega);
  ASSERT_TRUE(omega);
  EXPECT_FALSE(omega->slow);
  EXPECT_EQ(omega->size(), 2000U);
  EXPECT_EQ(omega->first, omega->last);
}

TEST(PrepareRun, HoldsOnceWhatIsTheSame) {
  emtb::Run recorded = record({}, synthetic::steps, 1e-3);
  recorded.signals[Signal::theta] = series(1e-3, 3, [](double t) { return 30 * t; });
  share_times(recorded.signals);
  const ObservedRun run = observe_run(recorded, servo_model());
  const double* const t = recorded.at(Signal::u_ref).t.data();
  EXPECT_EQ(run.excitation.t.data(), t);
  EXPECT_EQ(run.excitation.u_ref.data(), recorded.at(Signal::u_ref).value.data());
  EXPECT_EQ(run.excitation.angle.data(), recorded.at(Signal::theta).value.data());
  const std::uint32_t* const rows = observation(run, Signal::omega)->last.data();
  for (const Signal signal : {Signal::omega, Signal::i_a, Signal::e_a}) {
    const Observation* const o = observation(run, signal);
    ASSERT_TRUE(o);
    EXPECT_EQ(o->begin.data(), t);
    EXPECT_EQ(o->end.data(), t);
    EXPECT_EQ(o->first.data(), rows);
    EXPECT_EQ(o->last.data(), rows);
    EXPECT_EQ(o->value.data(), recorded.at(signal).value.data());
  }
}

TEST(PrepareRun, AMeanOverLessThanARowIsAnInstant) {
  emtb::Run run = plain_run();
  for (const bool whole_row : {false, true}) {
    run.signals[Signal::omega].window = whole_row ? 1e-3 : 0.6e-3;
    const ObservedRun observed = observe_run(run, servo_model());
    const Observation* omega = observation(observed, Signal::omega);
    ASSERT_TRUE(omega);
    EXPECT_EQ(omega->slow, whole_row);
    EXPECT_DOUBLE_EQ(omega->late_by_window(1e-3), whole_row ? 0 : 0.3) << "half of its window";
    EXPECT_EQ(omega->functional == Functional::instant, !whole_row);
  }
}

TEST(PrepareRun, AMeterWithAWindowReadsTheMeanOverIt) {
  emtb::Run run = plain_run();
  Series meter = series(0.5, 2, [](double) { return 1.0; });
  meter.window = 0.4;
  run.signals[Signal::i_a] = meter;
  const ObservedRun prepared = observe_run(run, servo_model());
  const Observation* i_a = observation(prepared, Signal::i_a);
  ASSERT_TRUE(i_a);
  EXPECT_TRUE(i_a->slow);
  EXPECT_THAT(i_a->first, ElementsAre(100, 600, 1100));  // the first window began before the run
  EXPECT_THAT(i_a->last, ElementsAre(500, 1000, 1500));
}

TEST(PrepareRun, AMeterWithoutAWindowReadsTheMeanSinceItsReadingBefore) {
  emtb::Run run = plain_run();
  Series& meter = run.signals[Signal::i_a];
  meter.t = {0.3, 0.7, 1.25, 1.9};
  meter.value = {1, 2, 3, 4};
  const ObservedRun prepared = observe_run(run, servo_model());
  const Observation* i_a = observation(prepared, Signal::i_a);
  ASSERT_TRUE(i_a);
  EXPECT_THAT(i_a->first, ElementsAre(300, 700, 1250));
  EXPECT_THAT(i_a->last, ElementsAre(700, 1250, 1900));
  EXPECT_THAT(i_a->value, ElementsAre(2, 3, 4));
}

TEST(Observation, PredictsAMeanByTheTrapezoidalRule) {
  Observation o;
  o.first = {0, 2};
  o.last = {4, 2};
  o.value = {0, 0};
  EXPECT_EQ(o.predicted(0, [](std::size_t k) { return static_cast<double>(k * k); }),
            (0.5 * 0 + 1 + 4 + 9 + 0.5 * 16) / 4);
  EXPECT_EQ(o.predicted(1, [](std::size_t k) { return static_cast<double>(k * k); }), 4);
}

TEST(PrepareRun, ComparesWithTheSlopeOfTheAngleWhereThereIsNoSpeed) {
  emtb::Run run = plain_run();
  run.signals.erase(Signal::omega);
  run.signals[Signal::theta] = series(1e-3, 2, [](double t) { return 30 * t; });
  const ObservedRun prepared = observe_run(run, servo_model());
  const Observation* omega = observation(prepared, Signal::omega);
  ASSERT_TRUE(omega);
  ASSERT_GT(omega->size(), 10U);
  for (std::size_t i = 0; i < omega->size(); ++i) {
    ASSERT_NEAR(omega->value[i], 30, 1e-9);
    ASSERT_LT(omega->first[i], omega->last[i]);
  }
  EXPECT_NEAR(prepared.excitation.initial.omega, 30, 0.1);
}

TEST(PrepareRun, ComparesNoTerminalVoltageOfAnOpenArmature) {
  emtb::Run run = plain_run();
  run.signals[Signal::e_a] = series(1e-3, 2, [](double t) { return t < 0.5 ? 0.0 : t < 1 ? 8.0 : 5.0; });
  run.signals[Signal::armature_open] = series(1e-3, 2, [](double t) { return t < 0.9995 ? 0.0 : 1.0; });
  const ObservedRun prepared = observe_run(run, servo_model());
  const Observation* e_a = observation(prepared, Signal::e_a);
  ASSERT_TRUE(e_a);
  EXPECT_EQ(e_a->size(), 1000U) << "on which side of the switch it is read nobody says";
  EXPECT_LT(e_a->end[999], 1);
}

TEST(PrepareRun, IsDrivenByAMeanOfTheVoltageAsItWasInTheMiddle) {
  const Model servo = servo_model();
  emtb::Run run = plain_run();
  run.signals[Signal::u_ref] = series(1e-3, 2, [](double t) { return t < 0.4995 ? 0.0 : 2.0; });
  run.signals[Signal::e_a] = series(1e-3, 2, [](double t) { return std::clamp(2000 * (t - 0.5) - 1, 0.0, 8.0); });
  run.signals[Signal::e_a].window = 1e-3;
  const Excitation x = observe_run(run, servo, Chaining::staged).excitation;
  const std::vector<double> driver = driver_voltage(servo, servo.values(), x);
  ASSERT_EQ(x.e_a.size(), driver.size());
  for (std::size_t k = 502; k < 520; ++k) EXPECT_NEAR(x.e_a[k], driver[k], 0.1) << k;
}

// ---- where it starts

TEST(PrepareRun, StartsAtTheSpeedThatTheFirstReadingsTell) {
  synthetic::Noise noise(4);
  emtb::Run run = plain_run();
  run.signals[Signal::omega] = series(1e-3, 2, [&](double t) { return 120 - 50 * t + noise(0.2); });
  EXPECT_NEAR(observe_run(run, servo_model()).excitation.initial.omega, 120, 0.3);
  run.signals[Signal::omega] = series(1e-3, 2, [&](double) { return noise(0.2); });
  const InitialState at_rest = observe_run(run, servo_model()).excitation.initial;
  EXPECT_EQ(at_rest.omega, 0) << "noise is no motion";
  EXPECT_EQ(at_rest.omega_doubt, 0);
}

TEST(PrepareRun, LeavesItOpenWhetherAShaftTurnsWhoseCoarseSpeedDoesNotTell) {
  constexpr double step = 0.4;  // [rad/s]
  const auto speeds = [&](double first) {
    emtb::Run run;
    run.name = "on the way";
    run.signals[Signal::u_ref] = series(2e-2, 2, [](double) { return 2.0; });
    run.signals[Signal::omega] = series(2e-2, 2, [&](double t) { return step * std::round((first + 30 * t) / step); });
    run.signals[Signal::omega].lsb = step;
    return observe_run(run, servo_model()).excitation.initial;
  };
  EXPECT_EQ(speeds(1.2).omega, 0);
  EXPECT_NEAR(speeds(1.2).omega_doubt, 1.2, step);
  EXPECT_NEAR(speeds(12).omega, 12, step) << "a clear motion is none of doubt";
}

TEST(PrepareRun, LeavesItOpenWhetherAShaftTurnsWhoseCoarseEncoderDoesNotTell) {
  constexpr double step = 0.0188;  // [rad] 334 a turn, read every 10 ms
  const auto angles = [&](double omega) {
    emtb::Run run = plain_run();
    run.signals.erase(Signal::omega);
    run.signals[Signal::theta] = series(1e-2, 2, [&](double t) { return step * std::floor(omega * t / step + 0.3); });
    run.signals[Signal::theta].lsb = step;
    return observe_run(run, servo_model()).excitation.initial;
  };
  EXPECT_EQ(angles(5).omega, 0);
  EXPECT_NEAR(angles(5).omega_doubt, 5, 2);
  EXPECT_NEAR(angles(50).omega, 50, 5) << "a clear motion is none of doubt";
  EXPECT_EQ(angles(0).omega_doubt, 0);
}

TEST(PrepareRun, StartsAsTheAngleTellsWhereATachogeneratorReadsASpeedAtRest) {
  emtb::Run run = plain_run();
  for (double& value : run.signals[Signal::omega].value.edit()) value -= 10;
  EXPECT_EQ(observe_run(run, servo_model()).excitation.initial.omega, -10) << "nothing else tells it";
  Series& angle = run.signals[Signal::theta] = series(1e-3, 2, [](double) { return 1.0; });
  angle.lsb = 1e-3;
  EXPECT_EQ(observe_run(run, servo_model()).excitation.initial.omega, 0);
  for (std::size_t k = 0; k < angle.t.size(); ++k) angle.value.edit()[k] = 1e-3 * std::floor(1e3 * 30 * angle.t[k]);
  EXPECT_NEAR(observe_run(run, servo_model()).excitation.initial.omega, 30, 0.1);
}

TEST(PrepareRun, StartsAsTheTachogeneratorReadsWhereAnAngleIsTooCoarseToTell) {
  constexpr double step = 0.08;  // [rad] 79 a turn, read every 20 ms
  const auto start = [&](double read, double turns) {
    emtb::Run run = plain_run();
    run.signals[Signal::u_ref] = series(1e-3, 2, [](double) { return 2.0; });
    run.signals[Signal::omega] = series(1e-3, 2, [&](double) { return read; });
    run.signals[Signal::theta] = series(2e-2, 2, [&](double t) { return step * std::floor(turns * t / step + 0.3); });
    run.signals[Signal::theta].lsb = step;
    return observe_run(run, servo_model()).excitation.initial.omega;
  };
  EXPECT_NEAR(start(3, 3), 3, 1e-6);
  EXPECT_EQ(start(1, 0), 0) << "nothing is counted for two seconds";
}

TEST(PrepareRun, StartsAtTheSpeedThatWasBeforeTheInputChanged) {
  emtb::Run run = plain_run();  // a small servo: at rest for 10 ms, at full speed 20 ms later
  run.signals.erase(Signal::omega);
  run.signals[Signal::u_ref] = series(1e-3, 2, [](double t) { return t < 0.01 ? 0.0 : 2.0; });
  run.signals[Signal::theta] =
      series(1e-3, 2, [](double t) { return 0.0027 * std::floor(400 * std::max(0.0, t - 0.011)); });
  run.signals[Signal::theta].lsb = 0.0027;
  const InitialState initial = observe_run(run, servo_model()).excitation.initial;
  EXPECT_EQ(initial.omega, 0);
  EXPECT_EQ(initial.omega_doubt, 0);
}

TEST(PrepareRun, AnAngleTellsManySpeedsAlsoOfAShortRun) {
  const auto speeds = [](double interval, double seconds) {
    emtb::Run run;
    run.name = "turns";
    run.signals[Signal::u_ref] = series(interval, seconds, [](double) { return 2.0; });
    run.signals[Signal::theta] = series(interval, seconds, [](double t) { return 30 * t; });
    return observe_run(run, servo_model()).find(Signal::omega)->size();
  };
  EXPECT_GT(speeds(5e-5, 0.1), 150U) << "100 ms of a small servo";
  EXPECT_NEAR(static_cast<double>(speeds(1e-3, 20)), 2000, 10) << "10 ms are short against a larger one";
}

// ---- what drives the model

TEST(PrepareRun, AVoltageThatIsUpdatedEveryFewRowsDrivesNoMotor) {
  emtb::Run run = record(synthetic::Truth{}, synthetic::steps, 1e-3, {.e_a = 0.05});
  EXPECT_TRUE(observe_run(run, servo_model()).measured_voltage);
  const std::span<double> e_a = run.signals[Signal::e_a].value.edit();
  for (std::size_t k = 0; k < e_a.size(); ++k) e_a[k] = e_a[k - k % 4];
  const ObservedRun held = observe_run(run, servo_model());
  EXPECT_FALSE(held.measured_voltage) << "nobody knows it in between";
  EXPECT_EQ(held.find(Signal::e_a)->size(), e_a.size() / 4) << "it is compared where it is new";
}

TEST(PrepareRun, AGaugeThatReadsZeroIsNoLoad) {
  synthetic::Noise noise(4);
  emtb::Run run = plain_run();
  run.signals[Signal::torque] = series(1e-3, 2, [&](double) { return noise(0.001); });
  ObservedRun prepared = observe_run(run, servo_model());
  EXPECT_FALSE(prepared.measured_load);
  EXPECT_TRUE(observation(prepared, Signal::torque)) << "it is still compared with";
  run.signals[Signal::torque] = series(1e-3, 2, [&](double t) { return (t < 1 ? 0 : 0.01) + noise(0.001); });
  prepared = observe_run(run, servo_model());
  EXPECT_TRUE(prepared.measured_load);
  EXPECT_TRUE(prepared.structure(servo_model()).measured_load);
  EXPECT_NEAR(prepared.excitation.load[1500], 0.01, 0.001);
}

// A shaft that turns back every 60 ms, 40 ms, 90 ms ..., and a brake that opposes it.
TEST(PrepareRun, ABrakeThatTurnsAroundOftenIsNoNoiseOfTheGauge) {
  const double torque = 0.1, sigma = 0.001;
  const auto brake = [&](double t) { return std::sin(60 * t) + std::sin(97 * t) < 0 ? -torque : torque; };
  synthetic::Noise noise(6);
  emtb::Run run = plain_run();
  run.signals[Signal::torque] = series(1e-3, 2, [&](double t) { return brake(t) + noise(sigma); });
  const ObservedRun prepared = observe_run(run, servo_model());
  ASSERT_TRUE(prepared.measured_load);
  for (std::size_t k = 0; k < prepared.length(); ++k) {
    ASSERT_NEAR(prepared.excitation.load[k], brake(prepared.excitation.t[k]), 5 * sigma) << k << ": an edge is smeared";
    ASSERT_LE(prepared.load_noise.sigma[k], 2 * sigma);
  }
}

TEST(PrepareRun, QuietsAMeasuredLoadButForWhatRepeatsWithTheAngle) {
  emtb::Run run = plain_run();
  const double speed = 180, ripple = 0.006, sigma = 0.002;  // [rad/s], [N m] of a weight off centre and of the noise
  synthetic::Noise noise(5);
  run.signals[Signal::omega] = series(1e-3, 20, [&](double) { return speed; });
  run.signals[Signal::u_ref] = series(1e-3, 20, [](double) { return 2.0; });
  run.signals[Signal::torque] = series(1e-3, 20, [&](double t) { return ripple * std::sin(speed * t) + noise(sigma); });
  const ObservedRun prepared = observe_run(run, servo_model());
  ASSERT_TRUE(prepared.measured_load);
  double squares = 0;
  for (std::size_t k = 0; k < prepared.length(); ++k) {
    squares += std::pow(prepared.excitation.load[k] - ripple * std::sin(speed * prepared.excitation.t[k]), 2);
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(prepared.length())), 0.25 * sigma);
}

TEST(PrepareRun, QuietsTheMeasuredVoltageWithoutTouchingItsCorners) {
  const double sigma = 0.05;
  const std::vector<synthetic::Hold> plan{{0.7, 0}, {0.8, 3}, {0.8, -4}, {0.7, 1}};
  const emtb::Run clean = record({}, plan, 1e-3), noisy = record({}, plan, 1e-3, {.e_a = sigma});
  const ObservedRun prepared = observe_run(noisy, servo_model());
  ASSERT_TRUE(prepared.measured_voltage);
  const std::vector<double>& e = prepared.excitation.e_a;
  const std::vector<double>& exact = clean.at(Signal::e_a).value;
  ASSERT_EQ(e.size(), exact.size());
  double squares = 0;
  for (std::size_t k = 0; k < e.size(); ++k) {
    ASSERT_LT(std::abs(e[k] - exact[k]), 4 * sigma) << "a corner was smeared at t = " << clean.at(Signal::e_a).t[k];
    squares += std::pow(e[k] - exact[k], 2);
    EXPECT_LE(prepared.voltage_noise.sigma[k], 1.2 * sigma);
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(e.size())), 0.25 * sigma);
}

TEST(PrepareRun, QuietsTheMeasuredVoltageAlsoWhereTheDriverIsNotAsKnown) {
  // Corners where the model does not expect them: a gain that is wrong by half, slopes that are wrong by four.
  const std::vector<synthetic::Hold> plan{{0.7, 0}, {0.8, 3}, {0.8, -4}, {0.7, 1}};
  const double sigma = 0.05;
  const emtb::Run run = record({}, plan, 1e-3, {.e_a = sigma});
  const std::vector<double> exact = record({}, plan, 1e-3).at(Signal::e_a).value;
  Model other_gain = servo_model(), other_slopes = servo_model();
  other_gain.driver->gain = 2;
  other_slopes.driver->rise = other_slopes.driver->fall = 8000;
  for (const Model& model : {other_gain, other_slopes}) {
    const std::vector<double> e = observe_run(run, model).excitation.e_a;
    double squares = 0, worst = 0;
    for (std::size_t k = 0; k < e.size(); ++k) {
      squares += std::pow(e[k] - exact[k], 2);
      worst = std::max(worst, std::abs(e[k] - exact[k]));
    }
    EXPECT_LT(worst, 8 * sigma);
    EXPECT_LT(std::sqrt(squares / static_cast<double>(e.size())), 0.5 * sigma);
  }
}

TEST(PrepareRun, AnEdgeOfTheMeasuredVoltageIsAsLargeAsItWasRead) {
  Model model = servo_model();
  model.driver = DriverModel{.gain = 4, .min = -24, .max = 24};
  synthetic::Noise noise(7);
  emtb::Run run = plain_run();
  run.signals[Signal::u_ref] = series(1e-3, 2, [](double t) { return t < 0.9995 ? 0.0 : 3.0; });
  run.signals[Signal::e_a] =
      series(1e-3, 2, [&](double t) { return (t < 1.0005 ? 0.0 : 5.0) + noise(0.01); });  // 12 V by the model
  const ObservedRun prepared = observe_run(run, model);
  ASSERT_TRUE(prepared.measured_voltage);
  EXPECT_NEAR(prepared.excitation.e_a_bulge[1000], 2.5, 0.05) << "it has acted from its row on";
}

TEST(PrepareRun, ChainedDrivesTheMotorWithTheDriverOfTheModel) {
  const emtb::Run run = record({}, synthetic::steps, 1e-3);
  EXPECT_TRUE(observe_run(run, servo_model()).measured_voltage);
  const ObservedRun chained = observe_run(run, servo_model(), Chaining::chained);
  EXPECT_FALSE(chained.measured_voltage);
  EXPECT_TRUE(observation(chained, Signal::e_a)) << "still compared with";
}

TEST(PrepareRun, KnowsWhenTheArmatureIsOpen) {
  emtb::Run run = plain_run();
  run.signals[Signal::armature_open] = series(1e-3, 2, [](double t) { return t > 1.5 ? 1.0 : 0.0; });
  const ObservedRun prepared = observe_run(run, servo_model());
  EXPECT_EQ(prepared.excitation.armature_open[1400], 0);
  EXPECT_EQ(prepared.excitation.armature_open[1600], 1);
}

// ---- messages

TEST(PrepareRun, SaysWhatIsMissing) {
  emtb::Run run = plain_run();
  run.signals.erase(Signal::u_ref);
  EXPECT_THAT(complaint_of_preparing(run),
              AllOf(HasSubstr("steps.csv#a has no u_ref_V"), HasSubstr("`servo`"), HasSubstr("--map")));
  run = plain_run();
  run.signals.erase(Signal::omega);
  EXPECT_THAT(complaint_of_preparing(run), AllOf(HasSubstr("steps.csv#a"), HasSubstr("omega_rad_s")));
  run = plain_run();
  run.signals[Signal::u_ref] = series(1e-3, 0.005, [](double) { return 1.0; });
  EXPECT_THAT(complaint_of_preparing(run), HasSubstr("too short: 5 samples"));
}

TEST(PrepareRun, RefusesAHoleInWhatDrivesTheModel) {
  emtb::Run run = record({}, synthetic::steps, 1e-3);
  Series& e_a = run.signals[Signal::e_a];
  e_a.t.erase(e_a.t.begin() + 800, e_a.t.begin() + 900);
  e_a.value.erase(e_a.value.begin() + 800, e_a.value.begin() + 900);
  EXPECT_THAT(complaint_of_preparing(run), AllOf(HasSubstr("e_a_V has no reading near t = 0.8"), HasSubstr("@T0:T1")));
}

/// A motor's step, read so often.
emtb::Run speeds(double interval) {
  emtb::Run run;
  run.name = "rows";
  run.signals[Signal::u_ref] = series(interval, 4, [](double t) { return t < 0.5 ? 0.0 : 2.0; });
  run.signals[Signal::omega] = series(interval, 4, [](double t) { return t < 0.5 ? 0.0 : 180.0; });
  return run;
}

TEST(SetSteps, AreThoseOfTheFittedMotorWhereRowsAreSimulatedInSeveral) {
  const Model given = servo_model();
  Model slower = given, about_as_slow = given, quicker = given;
  slower.base[base::J].value *= 4;
  quicker.base[base::J].value /= 4;
  about_as_slow.base[base::J].value *= 1.2;
  for (const double interval : {1e-4, 0.02}) {
    Dataset data = prepare(std::vector{speeds(interval)}, std::vector{speeds(interval)}, given);
    EXPECT_FALSE(set_steps(data, about_as_slow));
    EXPECT_FALSE(set_shorter_steps(data, slower)) << "what is slower is simulated well enough";
    EXPECT_EQ(set_shorter_steps(data, quicker), interval > 1e-3);
    EXPECT_EQ(set_steps(data, slower), interval > 1e-3) << "rows that are one step stay one";
    EXPECT_FALSE(set_steps(data, slower));
    Excitation wanted;
    set_steps(wanted, interval > 1e-3 ? slower : given);
    for (const Record& record : {data.train.front(), data.held_out.front()}) {
      EXPECT_EQ(record.excitation.longest_step, wanted.longest_step);
      EXPECT_EQ(record.excitation.quick_step, wanted.quick_step);
    }
  }
}

TEST(Record, CountsTheStepsOfItsSimulationsNotItsRows) {
  const Model model = servo_model();
  const Dataset quick = prepare(std::vector{speeds(1e-3)}, {}, model),
                slow = prepare(std::vector{speeds(0.2)}, {}, model);
  const auto work = [&](const Dataset& data) {
    const Record& record = data.train.front();
    const std::uint64_t before = data.effort->steps();
    record.count_simulation(record.structure(model), 0);
    return static_cast<double>(data.effort->steps() - before) / static_cast<double>(record.length());
  };
  EXPECT_EQ(work(quick), 1);
  EXPECT_NEAR(work(slow), 0.2 / slow.train.front().excitation.longest_step, 0.5);
}

TEST(Weighing, KnowsWhereAReadingThatStandsIsRounded) {
  constexpr double lsb = 0.2;  // A
  emtb::Run run = synthetic::record({}, {{0.2, 0}, {4, 2}, {4, -3}}, 1e-2, {.omega = 0.1, .i_a = 0.01, .e_a = 0.02});
  for (const bool coarse : {false, true}) {
    if (coarse) {
      run.signals[Signal::i_a].lsb = lsb;
      for (double& i : run.signals[Signal::i_a].value.edit()) i = lsb * std::round(i / lsb);
    }
    const Dataset data = prepare(std::vector{run}, {}, synthetic::servo_model());
    const std::vector<EqualReadings>& rounded = data.train.front().find(Signal::i_a)->rounded;
    EXPECT_EQ(rounded.empty(), !coarse);
    for (const EqualReadings& same : rounded) EXPECT_GE(same.length(), 16U);
  }
}

}  // namespace
}  // namespace emtb
