#include "analysis/estimate/static_experiments.h"

#include <gmock/gmock.h>

#include <array>
#include <cmath>

#include "analysis/estimate/acceleration.h"
#include "analysis/estimate/coast_down.h"
#include "analysis/estimate/driver_steps.h"
#include "analysis/estimate/electrical.h"
#include "analysis/estimate/switch_on.h"
#include "analysis/estimate/torque.h"
#include "hal/error.h"
#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

using synthetic::series;
using testing::Contains;
using testing::HasSubstr;

SettledPoint point(const std::map<Signal, double>& values, double error = 0) {
  SettledPoint p{.where = {"run", 0, 1}};
  for (const auto& [signal, value] : values) p.mean[signal] = {value, error, 100};
  return p;
}

// The lines that Erdal et al. (2011) print, as points that lie on them exactly.

TEST(PrintedLines, Figure4GivesArmatureResistanceAndBackEmf) {
  Settled settled;
  for (const double i : {0.08, 0.09, 0.1, 0.11}) {
    const double omega = 2000 * (i - 0.07);
    settled.points.push_back(
        point({{Signal::i_a, i}, {Signal::omega, omega}, {Signal::e_a, 0.6739 * omega + 31.825 * i}}));
  }
  for (const StaticEstimate& e : {estimate_equation_6(settled), estimate_armature(settled)}) {
    EXPECT_NEAR(e.at("R_a").value, 31.825, 1e-9) << name(e.method);
    EXPECT_NEAR(e.at("K_b").value, 0.6739, 1e-12) << name(e.method);
    EXPECT_NEAR(e.r_squared, 1, 1e-9);
    EXPECT_EQ(e.points, 4U);
  }
}

TEST(PrintedLines, Figure5GivesTheSlopeOfTheBrake) {
  Settled settled;
  for (const double omega : {60, 90, 120, 150}) {
    settled.points.push_back(
        point({{Signal::omega, omega}, {Signal::torque, 0.0001 * omega + 0.0865}, {Signal::e_a, 0.7 * omega + 6}}));
  }
  const StaticEstimate e = estimate_load_line(settled);
  EXPECT_NEAR(e.at("slope").value, 0.0001, 1e-12);
  EXPECT_NEAR(e.at("intercept").value, 0.0865, 1e-10);
  EXPECT_THAT(e.remarks, Contains(HasSubstr("the brake's")));
  for (SettledPoint& p : settled.points) p.mean[Signal::e_a].value = 110;
  EXPECT_THAT(estimate_load_line(settled).remarks, Contains(HasSubstr("the machine's own")));
}

TEST(PrintedLines, Figure6GivesTorqueConstantAndNoLoadLoss) {
  Settled settled;
  for (const double i : {0.11, 0.3, 0.5, 0.8}) {
    settled.points.push_back(point({{Signal::i_a, i}, {Signal::omega, 150}, {Signal::torque, 0.5024 * i - 0.0547}}));
  }
  const StaticEstimate e = estimate_torque_constant(settled);
  EXPECT_NEAR(e.at("K_m").value, 0.5024, 1e-10);
  EXPECT_NEAR(e.at("T_0").value, 0.0547, 1e-10);
}

/// Figure 7 as a run: up at 268.29 rad/s2, while an ammeter peaks at 1.73 A.
emtb::Run figure_7() {
  emtb::Run run;
  run.name = "figure 7";
  run.signals[Signal::omega] = series(1e-3, 2, [](double t) { return std::clamp(268.29 * (t - 0.5), 0.0, 150.0); });
  run.signals[Signal::i_a] = series(1e-3, 2, [](double t) { return t < 0.5 ? 0 : 1.73 * std::exp(-(t - 0.5) / 0.3); });
  run.signals[Signal::e_a] = series(1e-3, 2, [](double t) { return t < 0.499 ? 0.0 : 110.0; });
  return run;
}

TEST(PrintedLines, Section34GivesTheInertia) {
  const emtb::Run run = figure_7();
  KnownParameters known{.K_m = Quantity{"K_m", 0.5349, 0, "N m/A"}};
  StaticEstimate e = estimate_switch_on(std::span(&run, 1), known);
  EXPECT_NEAR(e.at("dω/dt").value, 268.29, 1e-6);
  EXPECT_NEAR(e.at("i_max").value, 1.73, 1e-9);
  EXPECT_NEAR(e.at("J").value, 0.003449178, 2e-8) << "as printed, with the 0.5349 of its product";
  known.K_m->value = 0.5024;
  known.T_c = Quantity{"T_c", 0.0547, 0, "N m"};
  e = estimate_switch_on(std::span(&run, 1), known);
  EXPECT_NEAR(e.at("J").value, 0.5024 * 1.73 / 268.29, 1e-9);
  EXPECT_NEAR(e.at("J_net").value, (0.5024 * 1.73 - 0.0547) / 268.29, 1e-9);
}

TEST(SwitchOn, RefusesAStartBehindTheDriver) {
  emtb::Run run = figure_7();
  run.signals[Signal::omega] = series(1e-3, 7, [](double t) { return std::clamp(33.4 * (t - 0.5), 0.0, 150.0); });
  run.signals[Signal::e_a] = series(1e-3, 7, [](double t) { return std::clamp(22.5 * (t - 0.5), 0.0, 110.0); });
  const StaticEstimate e = estimate_switch_on(std::span(&run, 1), {});
  EXPECT_THAT(e.lacking, HasSubstr("22.5 V/s"));
  EXPECT_THAT(e.lacking, HasSubstr("contactor"));
  EXPECT_FALSE(e.series.empty()) << "the curve is drawn all the same";
}

TEST(SwitchOn, SaysThatASlowMeterHidesThePeak) {
  emtb::Run run = figure_7();
  run.signals[Signal::i_a] = series(0.4, 2, [](double t) { return t < 0.5 ? 0 : 1; });
  run.signals[Signal::i_a].window = 0.4;
  const StaticEstimate e = estimate_switch_on(std::span(&run, 1), {.K_m = Quantity{"K_m", 0.5, 0, "N m/A"}});
  EXPECT_THAT(e.remarks, Contains(HasSubstr("averaged over 0.4 s")));
}

// Noise: the standard errors hold what they promise.

TEST(StaticEstimates, ErrorsOfResistanceAndBackEmfCover) {
  int inside = 0, all = 0;
  for (unsigned seed = 1; seed <= 300; ++seed) {
    synthetic::Noise noise(seed);
    Settled settled;
    for (int k = 0; k < 8; ++k) {
      const double i = 0.1 + 0.05 * k, omega = 20 + 17 * k;
      SettledPoint p = point({{Signal::i_a, i + noise(0.002)},
                              {Signal::omega, omega + noise(0.05)},
                              {Signal::e_a, 31.825 * i + 0.6739 * omega + noise(0.03)}});
      p.mean[Signal::i_a].std_error = 0.002;
      p.mean[Signal::omega].std_error = 0.05;
      p.mean[Signal::e_a].std_error = 0.03;
      settled.points.push_back(p);
    }
    for (const StaticEstimate& e : {estimate_equation_6(settled), estimate_armature(settled)}) {
      inside += std::abs(e.at("R_a").value - 31.825) < 1.96 * e.at("R_a").std_error;
      inside += std::abs(e.at("K_b").value - 0.6739) < 1.96 * e.at("K_b").std_error;
      all += 2;
    }
  }
  EXPECT_GT(inside, 0.92 * all);
  EXPECT_LT(inside, 0.995 * all);
}

TEST(StaticEstimates, ErrorsOfFrictionAndCoastDownCover) {
  int inside = 0, all = 0;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    synthetic::Noise noise(seed);
    Settled settled;
    for (int k = 1; k <= 8; ++k) {
      const double omega = 20.0 * k;
      SettledPoint p =
          point({{Signal::i_a, (0.05 + 1e-4 * omega) / 0.67 + noise(0.001)}, {Signal::omega, omega}}, 0.001);
      settled.points.push_back(p);
    }
    const StaticEstimate friction = estimate_friction(settled, {.K_m = Quantity{"K_m", 0.67, 0, "N m/A"}});
    inside += std::abs(friction.at("T_c").value - 0.05) < 1.96 * friction.at("T_c").std_error;
    inside += std::abs(friction.at("B").value - 1e-4) < 1.96 * friction.at("B").std_error;
    emtb::Run run;
    run.name = "coasting";
    // omega + T_c/B decays with J/B = 40 s
    run.signals[Signal::omega] = series(4e-3, 6, [&](double t) { return 660 * std::exp(-t / 40) - 500 + noise(0.2); });
    run.signals[Signal::armature_open] = series(4e-3, 6, [](double) { return 1; });
    const StaticEstimate coast = estimate_coast_down(std::span(&run, 1), {.T_c = Quantity{"T_c", 0.05, 0, "N m"}});
    inside += std::abs(coast.at("T_c/J").value - 12.5) < 1.96 * coast.at("T_c/J").std_error;
    inside += std::abs(coast.at("J").value - 0.004) < 1.96 * coast.at("J").std_error;
    all += 4;
  }
  EXPECT_GT(inside, 0.9 * all);
  EXPECT_LT(inside, 0.99 * all);
}

/// A small servo without dry friction, current on the card, up and down.
TEST(Acceleration, FindsTheInertiaFromAFastAndFromAnAveragingMeter) {
  const synthetic::Truth truth;
  emtb::Run run = synthetic::record(truth, {{0.2, 0}, {1, 2}, {1, 5}, {1, 1}, {1, 4}, {1, 2}}, 1e-3);
  const KnownParameters known{.K_m = Quantity{"K_m", truth.K_m, 0, "N m/A"}};
  const StaticEstimate fast = estimate_acceleration(std::span(&run, 1), known);
  EXPECT_NEAR(fast.at("J").value, truth.J, 0.02 * truth.J);
  Series slow;
  slow.window = 0.1;
  const Series current = run.at(Signal::i_a);
  for (std::size_t k = 100; k < current.t.size(); k += 100) {
    double sum = 0;
    for (std::size_t j = k - 100; j < k; ++j) sum += 0.5 * (current.value[j] + current.value[j + 1]) / 100;
    slow.t.push_back(current.t[k]);
    slow.value.push_back(sum);
  }
  run.signals[Signal::i_a] = slow;
  const StaticEstimate averaged = estimate_acceleration(std::span(&run, 1), known);
  EXPECT_NEAR(averaged.at("J").value, truth.J, 0.02 * truth.J);
}

TEST(Acceleration, OneRiseAloneCannotTellInertiaFromFriction) {
  const synthetic::Truth truth;
  const emtb::Run run = synthetic::record(truth, {{0.2, 0}, {1.5, 4}}, 1e-3);
  KnownParameters known{.K_m = Quantity{"K_m", truth.K_m, 0, "N m/A"}};
  EXPECT_THAT(estimate_acceleration(std::span(&run, 1), known).lacking, HasSubstr("cannot be told apart"));
  known.T_c = Quantity{"T_c", 0, 0, "N m"};
  known.B = Quantity{"B", truth.B, 0, "N m s/rad"};
  EXPECT_NEAR(estimate_acceleration(std::span(&run, 1), known).at("J").value, truth.J, 0.02 * truth.J);
}

emtb::Run driver_run(double dead_zone, double lag) {
  emtb::Run run;
  run.name = "driver";
  const std::vector<double> levels{0, 2, 4, 6, 3, 0};
  const auto reference = [&](double t) {
    return levels[std::min<std::size_t>(levels.size() - 1, static_cast<std::size_t>(t / 8))];
  };
  run.signals[Signal::u_ref] = series(1e-2, 48, reference);
  synthetic::Noise noise(5);
  double e = 0;
  run.signals[Signal::e_a] = series(1e-2, 48, [&](double t) {
    const double target = 18 * std::max(0.0, reference(t) - dead_zone);
    e = lag > 0 ? e + (target - e) * 1e-2 / lag : std::clamp(target, e - 0.2, e + 0.25);
    return e + noise(0.05);
  });
  return run;
}

TEST(Driver, ItsGainDeadZoneAndSlopesAreFound) {
  const emtb::Run run = driver_run(0.3, 0);
  const StaticEstimate gain = estimate_driver_gain(settled_points(std::span(&run, 1)));
  EXPECT_NEAR(gain.at("gain").value, 18, 0.01);
  EXPECT_NEAR(gain.at("dead_zone").value, 0.3, 0.005);
  const StaticEstimate slopes = estimate_driver_slopes(std::span(&run, 1));
  EXPECT_NEAR(slopes.at("rise").value, 25, 4 * slopes.at("rise").std_error + 0.05);
  EXPECT_NEAR(slopes.at("fall").value, -20, 4 * slopes.at("fall").std_error + 0.05);
  EXPECT_TRUE(slopes.remarks.empty());
  emtb::Run coasting = run;
  coasting.signals[Signal::armature_open] = series(1e-2, 48, [](double t) { return t > 39 ? 1 : 0; });
  const StaticEstimate fewer = estimate_driver_slopes(std::span(&coasting, 1));
  EXPECT_EQ(fewer.points, slopes.points - 2) << "what an open armature shows is not the driver";
  const emtb::Run plain = driver_run(0, 0);
  EXPECT_FALSE(estimate_driver_gain(settled_points(std::span(&plain, 1))).has("dead_zone"));
}

TEST(Driver, ALagIsNotTakenForASlope) {
  const emtb::Run run = driver_run(0, 0.8);
  EXPECT_THAT(estimate_driver_slopes(std::span(&run, 1)).remarks, Contains(HasSubstr("lag")));
}

TEST(Generator, NeedsAnOpenArmature) {
  emtb::Run run;
  run.name = "coasting";
  run.signals[Signal::omega] = series(1e-2, 6, [](double t) { return 100 - 15 * t; });
  run.signals[Signal::e_a] = series(1e-2, 6, [](double t) { return 0.7182 * (100 - 15 * t); });
  EXPECT_THAT(estimate_generator(std::span(&run, 1), {}).lacking, HasSubstr("armature_open"));
  run.signals[Signal::armature_open] = series(1e-2, 6, [](double) { return 1; });
  EXPECT_NEAR(estimate_generator(std::span(&run, 1), {}).at("K_b").value, 0.7182, 1e-9);
}

TEST(StaticEstimates, SayWhatIsLackingAndWhichExperimentWouldGiveIt) {
  const emtb::Run run = synthetic::record({}, {{3, 0}}, 1e-2);
  const Settled settled = settled_points(std::span(&run, 1));
  const std::vector<StaticEstimate> all = evaluate(static_experiments, std::span(&run, 1), settled);
  ASSERT_FALSE(all.empty());
  for (const StaticEstimate& e : all) {
    EXPECT_FALSE(e.lacking.empty()) << name(e.method);
    EXPECT_THAT(e.lacking, HasSubstr("need")) << name(e.method);
    EXPECT_TRUE(e.quantities.empty()) << name(e.method);
  }
}

TEST(StaticEstimates, AGuessOfKmGivesWayToTheData) {
  Settled settled;
  for (const double omega : {20, 60, 100, 140}) {
    const double i = (0.05 + 1e-4 * omega) / 0.67;
    settled.points.push_back(point({{Signal::i_a, i}, {Signal::omega, omega}, {Signal::e_a, 30 * i + 0.67 * omega}}));
  }
  constexpr std::array friction{StaticExperiment::friction};
  KnownParameters known{.K_m = Quantity{"K_m", 0.5, 0, "N m/A"}, .K_m_is_guess = true};
  EXPECT_NEAR(evaluate(friction, {}, settled, known)[1].at("T_c").value, 0.05, 1e-9);
  known.K_m_is_guess = false;
  EXPECT_NEAR(evaluate(friction, {}, settled, known)[1].at("T_c").value, 0.05 * 0.5 / 0.67, 1e-9);
}

TEST(StaticEstimates, AnAngleGivesTheSpeed) {
  emtb::Run run;
  run.signals[Signal::theta] = series(1e-3, 3, [](double t) { return 5 * t * t; });
  const emtb::Run with = with_speed({run}).front();
  const Series& omega = with.at(Signal::omega);
  EXPECT_EQ(omega.t.size(), run.at(Signal::theta).t.size());
  for (std::size_t k = 100; k < 2900; k += 100) EXPECT_NEAR(omega.value[k], 10 * omega.t[k], 1e-9);
}

TEST(StaticEstimates, LeaveOutPointsWithAReason) {
  Settled settled;
  settled.points.push_back(point({{Signal::omega, 5}, {Signal::e_a, 7}}));
  settled.points.push_back(point({{Signal::omega, 5}, {Signal::e_a, 7}, {Signal::i_a, 0.001}}, 0.001));
  settled.points.push_back(
      point({{Signal::omega, 5}, {Signal::e_a, 7}, {Signal::i_a, 0.1}, {Signal::armature_open, 1}}));
  const StaticEstimate e = estimate_equation_6(settled);
  ASSERT_EQ(e.left_out.size(), 3U);
  EXPECT_THAT(e.left_out[0].why, HasSubstr("no reading of i_a"));
  EXPECT_THAT(e.left_out[1].why, HasSubstr("armature is open"));
  EXPECT_THAT(e.left_out[2].why, HasSubstr("lost in its own error"));
  EXPECT_THAT(e.lacking, HasSubstr("staircase"));
}

}  // namespace
}  // namespace emtb
