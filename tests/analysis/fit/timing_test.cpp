#include "analysis/fit/timing.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <vector>

#include "analysis/record/dataset.h"
#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

using synthetic::Noise;
using synthetic::parameter;

constexpr double R_a = 1.2, K = 0.042, B = 1.2e-5, J = 6e-5, interval = 2e-3;  // tau = R_a J/K^2 = 41 ms

/// A driver that follows at once, a motor without inductance, and a logger.
Model bridge_model() {
  Model m = synthetic::servo_model();
  m.driver = DriverModel{.gain = 1, .min = -24, .max = 24};
  return m;
}

/// How a logger goes about a row.
struct Logging {
  bool read_after = false;             ///< the row's reference is written before the readings are taken
  std::map<Signal, double> late = {};  ///< [rows] by which an instrument shows what was
  double voltage_noise = 0.01;         ///< [V]
  double speed_noise = 0.05;           ///< [rad/s]
  std::size_t hold = 80;               ///< rows from one step to the next
  std::size_t behind = 0;              ///< rows by which the reference is written too late
};

/// The reference of each row: steps.
double reference(std::size_t row, std::size_t hold) {
  return std::array{6.0, -4.0, 9.0, 2.0, -7.0, 0.0, 5.0}.at((row / hold) % 7);
}

/// The speed over time is an exponential for each row; the current jumps with the voltage.
Run logged(const Logging& logging, unsigned seed = 1) {
  constexpr std::size_t rows = 560;
  constexpr double after = 1e-6;  // of a row: between write and reading
  const double damping = B + K * K / R_a, tau = J / damping;
  std::vector<double> omega{0};  // at the beginning of each row
  for (std::size_t row = 0; row < rows; ++row) {
    const double settled = K / R_a * reference(row, logging.hold) / damping;
    omega.push_back(settled + (omega.back() - settled) * std::exp(-interval / tau));
  }
  const auto voltage_at = [&](double row) {
    return row < 0 ? 0.0 : reference(static_cast<std::size_t>(row), logging.hold);
  };
  const auto speed_at = [&](double row) {
    if (row < 0) return 0.0;
    const auto k = static_cast<std::size_t>(row);
    const double settled = K / R_a * reference(k, logging.hold) / damping;
    return settled + (omega[k] - settled) * std::exp(-(row - static_cast<double>(k)) * interval / tau);
  };
  const auto value_at = [&](Signal signal, double row) {
    const double e = voltage_at(row), w = speed_at(row);
    return signal == Signal::e_a ? e : signal == Signal::omega ? w : (e - K * w) / R_a;
  };
  Run run;
  run.name = "logged";
  Noise noise(seed);
  const std::map<Signal, double> sigma{
      {Signal::e_a, logging.voltage_noise}, {Signal::i_a, 0.005}, {Signal::omega, logging.speed_noise}};
  for (std::size_t k = 1; k < rows; ++k) {
    const double t = static_cast<double>(k) * interval;
    run.signals[Signal::u_ref].t.push_back(t);
    run.signals[Signal::u_ref].value.push_back(reference(k - std::min(k, logging.behind), logging.hold));
    const double read = static_cast<double>(k) + (logging.read_after ? after : -after);
    for (const auto& [signal, s] : sigma) {
      const auto late = logging.late.find(signal);
      run.signals[signal].t.push_back(t);
      run.signals[signal].value.push_back(value_at(signal, read - (late != logging.late.end() ? late->second : 0)) +
                                          noise(s));
    }
  }
  return run;
}

struct Fitted {
  Calibration fit;
  Timing timing;

  /// By how many of its errors a parameter is off.
  double off(std::size_t place, double truth) const {
    return std::abs(fit.model.at(place).value - truth) / fit.model.at(place).std_error.value();
  }
};

Fitted fitted(Run run, bool with_voltage = true) {
  if (!with_voltage) run.signals.erase(Signal::e_a);
  Dataset data = prepare(std::vector{std::move(run)}, {}, bridge_model());
  Fitted f{calibrate(data, bridge_model()), {}};
  f.timing = data.timing;
  return f;
}

TEST(TimingOfRows, IsFoundWhetherARowIsReadBeforeItIsWrittenOrAfter) {
  for (const bool with_voltage : {false, true}) {
    const Fitted before = fitted(logged({.read_after = false}), with_voltage);
    const Fitted after = fitted(logged({.read_after = true}), with_voltage);
    EXPECT_EQ(before.timing.acts_after, 0) << with_voltage;
    EXPECT_LT(after.timing.acts_after, 0) << with_voltage;
    EXPECT_GT(after.timing.acts_after, -0.1 * interval) << with_voltage;
    for (const Fitted& f : {before, after}) {
      EXPECT_TRUE(f.timing.late.empty()) << with_voltage;
      EXPECT_NEAR(f.fit.model.at(base::R_a).value, R_a, 0.005) << with_voltage;
      EXPECT_NEAR(f.fit.model.at(base::J).value, J, 0.005 * J) << with_voltage;
    }
  }
}

/// Of every fifth row's current alone, as it is or its mean over the five.
Run with_slow_current(Run run, bool mean) {
  constexpr std::size_t every = 5;
  const Series all = run.signals[Signal::i_a];
  std::vector<double> t, value;
  for (std::size_t k = every; k < all.t.size(); k += every) {
    double sum = 0;
    for (std::size_t i = k - every + 1; i <= k; ++i) sum += all.value[i];
    t.push_back(all.t[k]);
    value.push_back(mean ? sum / every : all.value[k]);
  }
  run.signals[Signal::i_a].t = std::move(t);
  run.signals[Signal::i_a].value = std::move(value);
  return run;
}

TEST(TimingOfRows, TellsWhetherASlowMeterAverages) {
  const Fitted at_once = fitted(with_slow_current(logged({}), false)),
               mean = fitted(with_slow_current(logged({}), true));
  EXPECT_TRUE(at_once.timing.meters_at_once);
  EXPECT_NEAR(at_once.fit.model.at(base::R_a).value, R_a, 0.005);
  EXPECT_NEAR(at_once.fit.model.at(base::J).value, J, 0.005 * J);
  EXPECT_FALSE(mean.timing.meters_at_once);
}

TEST(TimingOfRows, IsFoundWhereTheReferenceOfARowIsWrittenWithTheNext) {
  const Fitted before = fitted(logged({.read_after = false, .behind = 1}), false);
  EXPECT_NEAR(before.timing.acts_after, -interval, 1e-9);
  EXPECT_EQ(before.timing.rows_early, 0U);
  const Fitted after = fitted(logged({.read_after = true, .behind = 1}), false);
  EXPECT_GT(after.timing.acts_after, -0.01 * interval) << "just before the reading";
  EXPECT_EQ(after.timing.rows_early, 1U) << "of the row before";
  for (const Fitted* f : {&before, &after}) {
    EXPECT_LT(f->off(base::R_a, R_a), 4);
    EXPECT_LT(f->off(base::J, J), 4);
  }
}

TEST(TimingOfRows, OfAVoltageThatIsReadARowLateIsPutRight) {
  const Fitted f = fitted(logged({.read_after = true, .late = {{Signal::e_a, 0.4}}}));
  EXPECT_EQ(f.timing.voltage_late, 1);
  EXPECT_NEAR(f.fit.model.at(base::R_a).value, R_a, 0.01);
  EXPECT_NEAR(f.fit.model.at(base::J).value, J, 0.01 * J);
}

TEST(TimingOfRows, IsNotToldByAStartThatANoisySpeedTellsBadly) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    emtb::Run run = logged({.speed_noise = 3}, seed);
    for (auto& [signal, series] : run.signals) {  // it begins while the shaft slows down
      const auto first = static_cast<std::ptrdiff_t>(90);
      series.t.erase(series.t.begin(), series.t.begin() + first);
      series.value.erase(series.value.begin(), series.value.begin() + first);
      const double begin = series.t.front();
      for (double& t : series.t.edit()) t -= begin;
    }
    const Fitted f = fitted(std::move(run), false);
    EXPECT_EQ(f.timing.acts_after, 0) << seed;
    EXPECT_TRUE(f.timing.late.empty()) << seed;
    EXPECT_LT(f.off(base::R_a, R_a), 3) << seed;
    EXPECT_LT(f.off(base::J, J), 3) << seed;
  }
}

TEST(TimingOfRows, IsNotToldByTheNoiseOfAVoltageThatALateReadingWouldAverage) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const Fitted noisy = fitted(logged({.voltage_noise = 0.1, .hold = 10}, seed));  // ten times the current's, over R_a
    EXPECT_TRUE(noisy.timing.late.empty()) << seed;
    EXPECT_LT(noisy.off(base::R_a, R_a), 3) << seed;
  }
}

TEST(TimingOfRows, IsNotAskedOfACurrentWithHoles) {
  emtb::Run run = logged({.read_after = true, .late = {{Signal::e_a, 0.4}}});
  Series& i_a = run.signals[Signal::i_a];
  i_a.t.erase(i_a.t.begin() + 100, i_a.t.begin() + 140);
  i_a.value.erase(i_a.value.begin() + 100, i_a.value.begin() + 140);
  EXPECT_EQ(prepare(std::vector{run}, {}, bridge_model()).timing.voltage_late, 0);
}

TEST(TimingOfRows, IsAPartOfTheErrorsOfWhatACurrentTellsThatMayBeReadLate) {
  // Read half a row late, it is 2.4 % smaller wherever it decays.
  const Fitted late = fitted(logged({.read_after = false, .late = {{Signal::i_a, 0.5}}}), false);
  EXPECT_LT(late.off(base::R_a, R_a), 3);
  EXPECT_LT(late.off(base::J, J), 3);
  EXPECT_LT(late.off(base::K_b, K), 3);
}

TEST(TimingOfRows, IsNoPartOfTheErrorsOfWhatItDoesNotMove) {
  const Fitted f = fitted(logged({}), false);
  EXPECT_LT(f.fit.model.at(base::K_b).std_error.value(), 2e-3 * K);
  EXPECT_GT(f.fit.model.at(base::R_a).std_error.value(), 2e-3 * R_a);  // 0.29 of a row of 2 ms in 41 ms
  EXPECT_LT(f.fit.model.at(base::R_a).std_error.value(), 2e-2 * R_a);
}

TEST(TimingOfRows, IsThatOfTheMiddleOfAWindowWhereNothingTellsMore) {
  for (const double window : {0.0, 0.5 * interval}) {
    emtb::Run run = logged({.late = {{Signal::omega, 0.25}}});
    run.signals[Signal::omega].window = window;
    const Dataset data = prepare(std::vector{run}, {}, bridge_model());
    EXPECT_NEAR(data.train.front().find(Signal::omega)->late, window > 0 ? 0.25 : 0, 1e-9) << "before any fit";
    const Fitted f = fitted(run);
    EXPECT_EQ(f.timing.late.contains(Signal::omega), window == 0) << "what the window says is no news";
    EXPECT_NEAR(f.fit.model.at(base::J).value, J, 0.005 * J);
  }
}

TEST(TimingOfRows, IsToldByTheReadingsWhereTheWindowSaysOtherwise) {
  emtb::Run run = logged({});
  run.signals[Signal::omega].window = 0.9 * interval;
  const Fitted f = fitted(run);
  ASSERT_TRUE(f.timing.late.contains(Signal::omega));
  EXPECT_NEAR(f.timing.late.at(Signal::omega), 0, 0.1);
}

TEST(TimingOfRows, AnInstrumentIsBehindByTheSameTimeInRowsThatAreNotAlike) {
  Record record;
  record.excitation.t = {0, 1, 3, 4};
  record.observations.emplace_back().signal = Signal::omega;
  Timing timing;
  timing.late[Signal::omega] = 0.3;  // of 4/3 s
  set_timing(std::span(&record, 1), timing);
  EXPECT_THAT(std::span(record.observations[0].late_by_row).subspan(1),
              testing::ElementsAre(testing::DoubleEq(0.4), testing::DoubleEq(0.2), testing::DoubleEq(0.4)));
}

TEST(TimingOfRows, IsNotToldByASignalThatTheModelDoesNotFollow) {
  // A contact that lets go a little late: 60 of the current's floors for a few rows after each step, none of its speed.
  emtb::Run run = logged({.read_after = false});
  const std::span<double> i_a = run.signals[Signal::i_a].value.edit();
  for (std::size_t k = 0; k < i_a.size(); ++k) {
    if ((k + 1) % 80 >= 1 && (k + 1) % 80 < 7) i_a[k] += reference(k + 1, 80) > 0 ? 0.3 : -0.3;
  }
  EXPECT_FALSE(fitted(std::move(run), false).timing.late.contains(Signal::omega));
}

TEST(TimingOfRows, IsNotToldByNoiseThatRemembers) {
  int told = 0;
  constexpr unsigned seeds = 12;
  for (unsigned seed = 1; seed <= seeds; ++seed) {
    emtb::Run run = logged({.read_after = false}, seed);
    const std::span<double> i_a = run.signals[Signal::i_a].value.edit();
    const std::vector<double> noise = synthetic::coloured(i_a.size(), 0.9, seed);
    for (std::size_t k = 0; k < i_a.size(); ++k) i_a[k] += 0.2 * noise[k];
    told += fitted(std::move(run), false).timing.late.contains(Signal::i_a) ? 1 : 0;
  }
  EXPECT_LE(told, 1) << "of " << seeds;
}

TEST(TimingOfRows, ACurrentThatIsReadLateHasFollowedTheDriversSlopeUntilThen) {
  // Rows of 10 ms, slopes of 4 to 16 ms: the current is where the voltage has come to by the time of its reading, not
  // on a straight line from row to row.
  constexpr std::size_t finer = 10, behind = 4;
  const emtb::Run fine = synthetic::record(synthetic::Truth{}, synthetic::steps, 1e-3, {.omega = 0.05, .i_a = 0.005});
  emtb::Run run;
  run.name = "coarse";
  for (const Signal signal : {Signal::u_ref, Signal::omega, Signal::i_a}) {
    const Series& all = fine.at(signal);
    Series& rows = run.signals[signal];
    for (std::size_t k = 0; k < all.t.size(); k += finer) {
      rows.t.push_back(all.t[k]);
      rows.value.push_back(all.value[signal == Signal::i_a && k > 0 ? k - behind : k]);
    }
  }
  Dataset data = prepare(std::vector{run}, {}, synthetic::servo_model());
  const Calibration fit = calibrate(data, synthetic::servo_model());
  EXPECT_NEAR(data.timing.late.at(Signal::i_a), 0.4, 0.05);
  EXPECT_NEAR(fit.model.at(base::R_a).value, synthetic::Truth{}.R_a, 0.01);
  EXPECT_NEAR(fit.model.at(base::K_b).value, synthetic::Truth{}.K_b, 2e-4);
}

TEST(TimingOfRows, IsNoDelayOfAllInstrumentsByMoreThanARow) {
  constexpr double rows_late = 1.6;
  const auto late_of = [](const Timing& timing, Signal signal) {
    const auto late = timing.late.find(signal);
    return late != timing.late.end() ? late->second : 0;
  };
  const auto late_together = [&](const Timing& t) {
    return std::min(late_of(t, Signal::omega), late_of(t, Signal::i_a));
  };
  const auto all_late = [](double rows) { return logged({.late = {{Signal::omega, rows}, {Signal::i_a, rows}}}); };
  const Timing two = fitted(all_late(2), false).timing;
  EXPECT_LE(two.acts_after / interval + late_together(two), 1.1);

  // What is more is the driver's. Beside it nothing is late as a whole: the current tells its delay to a row only.
  emtb::Run run = all_late(rows_late);
  run.signals.erase(Signal::e_a);
  Model model = fitted(run).fit.model;
  model.include(effect_index("driver_delay"));
  model.parameters_of(effect_index("driver_delay"))[0].value = 1.2 * interval;
  Dataset data = prepare(std::vector{run}, {}, model);
  const Calibration fit = calibrate(data, model);
  EXPECT_LT(late_together(data.timing), 0.05);
  const double delay = fit.model.parameters_of(effect_index("driver_delay"))[0].value / interval;
  EXPECT_GE(delay, 1);
  EXPECT_NEAR(delay + late_of(data.timing, Signal::omega), rows_late, 0.05);
}

TEST(TimingOfRows, OfAnInstrumentIsToldByTheModelWhereThatHasAnEffectForIt) {
  Model model = bridge_model();
  model.include(effect_index("speed_delay"));
  model.parameters_of(effect_index("speed_delay"))[0].value = 0.6 * interval;
  emtb::Run run = logged({.read_after = false, .late = {{Signal::omega, 0.6}}});
  run.signals.erase(Signal::e_a);
  Dataset data = prepare(std::vector{run}, {}, model);
  data.timing.late[Signal::omega] = 0.6;  // as it was found without the effect
  set_timing(data, data.timing);
  const Calibration fit = calibrate(std::span<const Record>(data.train), model);
  EXPECT_NEAR(fit.model.parameters_of(effect_index("speed_delay"))[0].value, 0.6 * interval, 0.1 * interval);
}

TEST(CalibrateDataset, TakesStepsThatAreShortEnoughForWhatItFits) {
  Model slow = synthetic::servo_model();
  slow.base[base::J].value = 1e-3;  // [kg m2] of 6e-5
  const std::vector<emtb::Run> runs{synthetic::record({}, synthetic::steps, 0.02, {.omega = 0.1, .i_a = 0.02})};
  Dataset data = prepare(runs, {}, slow);
  Excitation needed;
  set_steps(needed, calibrate(data, slow).model);
  const Excitation& taken = data.train.front().excitation;
  EXPECT_LT(taken.longest_step, 1.5 * needed.longest_step);
  EXPECT_LT(taken.quick_step, 1.5 * needed.quick_step);
}

}  // namespace
}  // namespace emtb
