#include "analysis/record/counted_speed.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>

#include "analysis/record/dataset.h"
#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

constexpr double per_line = 2 * std::numbers::pi;

/// A shaft that runs up to a speed, stays, and slows down again [rad].
double angle_at(double t, double speed) {
  constexpr double tau = 0.2;
  const double up = speed * (t - tau * (1 - std::exp(-t / tau)));
  if (t < 2) return up;
  return up - 0.6 * speed * ((t - 2) - tau * (1 - std::exp(-(t - 2) / tau)));
}

struct Logger {
  double interval = 0.005;  // [s]
  double jitter = 0;        // of it
  double step = per_line / 1320;
  double speed = 20;  // [rad/s]
};

/// What a logger makes of an encoder: the difference of two counts over the time between them.
Run counted(const Logger& logger) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> early(0, logger.jitter * logger.interval);
  Series omega;
  double last_t = -logger.interval, last = 0;
  for (int k = 0; k * logger.interval < 4; ++k) {
    const double t = k * logger.interval + early(random);
    const double counts = std::floor(angle_at(t, logger.speed) / logger.step + 0.3);
    omega.t.push_back(t);
    omega.value.push_back((counts - last) * logger.step / (t - last_t));
    last = counts, last_t = t;
  }
  return {.name = "counted", .signals = {{Signal::omega, omega}}};
}

/// A tachogenerator behind a coarse converter.
Run converted(double lsb, double noise) {
  std::mt19937 random(2);
  std::normal_distribution<double> draw(0, noise * lsb);
  Series omega;
  for (int k = 0; k < 800; ++k) {
    const double t = 0.005 * k, speed = (angle_at(t + 1e-4, 20) - angle_at(t, 20)) / 1e-4;
    omega.t.push_back(t);
    omega.value.push_back(lsb * std::round((speed + draw(random)) / lsb));
  }
  omega.lsb = lsb;
  return {.name = "converted", .signals = {{Signal::omega, omega}}};
}

/// What a logger makes of its counts that writes the mean of its last rows.
Run averaged(const Run& each, std::size_t rows) {
  Run run = each;
  Series& omega = run.signals.at(Signal::omega);
  const std::vector<double> raw = omega.value;
  for (std::size_t k = 0; k < raw.size(); ++k) {
    double sum = 0;
    for (std::size_t j = k + 1 > rows ? k + 1 - rows : 0; j <= k; ++j) sum += raw[j];
    omega.value.edit()[k] = sum / static_cast<double>(rows);
  }
  return run;
}

/// What a logger makes of it that smooths, and writes so many digits.
Run smoothed(const Run& each, double kept, double digit) {
  Run run = each;
  double last = 0;
  for (double& y : run.signals.at(Signal::omega).value.edit()) {
    last = kept * last + (1 - kept) * y;
    y = digit * std::round(last / digit);
  }
  return run;
}

std::optional<CountedSpeed> look_at(const Run& run) { return counted_speed(std::span(&run, 1)); }

TEST(CountedSpeed, IsToldByItsStepAWholePartOfATurn) {
  const auto found = look_at(counted({}));
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->step, per_line / 1320, 1e-9);
}

TEST(CountedSpeed, IsToldWhereOnlyOneCountFallsInManyReadings) {
  const auto found = look_at(counted({.interval = 2e-4, .step = per_line / 122, .speed = 8}));
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->step, per_line / 122, 1e-9);
}

TEST(CountedSpeed, IsToldWhereTheTimesJitter) {
  const auto found = look_at(counted({.jitter = 0.2}));
  ASSERT_TRUE(found);
  EXPECT_TRUE(found->measured_time);
  EXPECT_NEAR(found->step, per_line / 1320, 1e-9);
}

TEST(CountedSpeed, OfAnAxisWhoseStepIsNoPartOfATurnIsToldBecauseItsCountsAddUp) {
  const auto found = look_at(counted({.interval = 1e-3, .step = 4.2017e-3, .speed = 5}));
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->step, 4.2017e-3, 1e-9);
}

TEST(CountedSpeed, OfAnAxisWhoseCountsAreRareIsToldBecauseTheyAddUp) {
  const auto found = look_at(counted({.interval = 2e-4, .step = 4.2017e-3, .speed = 1.2}));
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->step, 4.2017e-3, 1e-9);
}

/// An axis that swings, and stays nowhere, over 8 s; its speed as it is made of counts, or of a converter.
Run swinging(double step, bool is_counted, double noise) {
  constexpr double interval = 0.005, amplitude = 4;
  const auto place = [](double t) {
    return amplitude * (-std::cos(2.5 * t) / 2.5 - 0.6 * std::cos(3.7 * t + 1) / 3.7);
  };
  std::mt19937 random(5);
  std::normal_distribution<double> draw(0, 1);
  Series omega;
  for (int k = 1; k < 1600; ++k) {
    const double t = interval * k, lsb = step / interval;
    const double counts = std::floor(place(t) / step) - std::floor(place(t - interval) / step);
    const double speed = (place(t) - place(t - interval)) / interval;
    omega.t.push_back(t);
    omega.value.push_back(lsb * (is_counted ? counts : std::round(speed / lsb + noise * draw(random))));
  }
  return {.name = "swinging", .signals = {{Signal::omega, omega}}};
}

TEST(CountedSpeed, OfAWheelThatStaysNowhereIsToldByRowsThatLastUnlikeLong) {
  constexpr double step = 0.00322;  // rad; no whole part of a turn
  const auto angle = [](double t) { return 20 * t + 5 * std::sin(3 * t) + 2 * std::sin(9 * t); };
  const auto run = [&](auto duration) {
    Series omega;
    double t = 0, last = 0;
    for (int k = 0; k < 120; ++k) {
      const double dt = duration(k), counts = std::floor(angle(t + dt) / step);
      omega.t.push_back(t += dt);
      omega.value.push_back((counts - last) * step / dt);
      last = counts;
    }
    return std::vector<emtb::Run>{{.name = "wheel", .signals = {{Signal::omega, omega}}}};
  };
  const auto found = counted_speed(run([](int k) { return k % 3 == 0 ? 0.011 : 0.010; }));
  ASSERT_TRUE(found);
  EXPECT_TRUE(found->measured_time);
  EXPECT_NEAR(found->step, step, 1e-6);
  EXPECT_FALSE(counted_speed(run([](int) { return 0.010; }))) << "as a converter's codes would be";
}

TEST(CountedSpeed, OfAnAxisThatStaysNowhereIsToldByHowItsCountsErr) {
  for (const double step : {4.2017e-3, 1.31e-3}) {
    const auto found = look_at(swinging(step, true, 0));
    ASSERT_TRUE(found) << step;
    EXPECT_NEAR(found->step, step, 1e-9);
    for (const double noise : {0.0, 0.1, 0.3, 0.6, 1.0}) EXPECT_FALSE(look_at(swinging(step, false, noise))) << noise;
  }
}

TEST(CountedSpeed, IsNotThatOfNoiseThatSeldomReachesTheNextCode) {
  emtb::Run run = counted({.interval = 2e-4, .step = 4.2017e-3, .speed = 1.2});
  std::mt19937 random(4);
  const std::span<double> speeds = run.signals.at(Signal::omega).value.edit();
  std::ranges::shuffle(speeds, random);  // as often, without a shaft
  EXPECT_FALSE(look_at(run));
}

/// A shaft that never keeps a speed for long, read to so many rad/s, without noise.
Run restless(double interval, double lsb) {
  Series omega;
  double speed = 0;
  for (int k = 0; k < 600; ++k) {
    speed += 0.3 * (110 * std::sin(2.1 * (k / 20)) - speed);
    omega.t.push_back(interval * k);
    omega.value.push_back(lsb * std::round(speed / lsb));
  }
  return {.name = "restless", .signals = {{Signal::omega, omega}}};
}

TEST(CountedSpeed, OfAShaftThatNeverKeepsASpeedIsToldByATurnOfWholeSteps) {
  const auto found = look_at(restless(0.05, per_line / 306 / 0.05));
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->step, per_line / 306, 1e-9);
}

TEST(CountedSpeed, OfAControllerThatKeepsASpeedOnceIsToldByATurnOfWholeSteps) {
  emtb::Run run = restless(0.02, per_line / 1654 / 0.02);
  Series& omega = run.signals.at(Signal::omega);
  const double step = per_line / 1654 / 0.02;
  for (std::size_t k = 96; k < 104; ++k) omega.value.edit()[k] = step * (300 + static_cast<double>(k % 3 == 0));
  const auto found = look_at(run);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->step, per_line / 1654, 1e-9);
}

TEST(CountedSpeed, IsToldWhereACountARowHappensToBeNearARoundSpeed) {
  // 83.026 degrees a second: near 83 by chance, where the turn has 1084.0000 steps.
  const auto found = look_at(restless(0.004, per_line / 1084 / 0.004));
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->step, per_line / 1084, 1e-9);
}

TEST(CountedSpeed, IsNotThatOfRoundSpeedsThatWereWrittenWithFewDigits) {
  emtb::Run run = restless(0.05, per_line / 60);
  for (double& y : run.signals.at(Signal::omega).value.edit()) y = std::round(y * 1e4) / 1e4;
  EXPECT_FALSE(look_at(run));
}

TEST(CountedSpeed, IsNotThatOfSpeedsThatWereRoundedToWholeRevolutionsPerMinute) {
  for (const double rpm : {1.0, 2.0, 0.5}) EXPECT_FALSE(look_at(restless(0.05, rpm * per_line / 60))) << rpm;
}

TEST(CountedSpeed, IsNotThatOfADisplayOfWholeRevolutionsPerMinuteInRowsOfARoundTime) {
  // In such rows a turn is a whole number of steps, and half a revolution of noise is no more than counts make.
  constexpr double lsb = per_line / 60, sigma = 0.5 * lsb;
  for (const double row : {0.02, 0.05, 0.1}) {
    synthetic::Noise noise(7);
    Series omega;
    for (int k = 0; k < 1200; ++k) {
      const double level = std::min(0.1 * k, 40 + 15.0 * (k / 150 % 4));
      omega.t.push_back(row * k);
      omega.value.push_back(lsb * std::round((level + noise(sigma)) / lsb));
    }
    EXPECT_FALSE(look_at({.name = "display", .signals = {{Signal::omega, omega}}})) << row;
  }
}

TEST(CountedSpeed, IsNotThatOfATachogeneratorBehindACoarseConverter) {
  for (const double noise : {0.1, 0.3, 1.0, 5.0}) EXPECT_FALSE(look_at(converted(0.23, noise))) << noise << " LSB";
}

/// The times of a run as a logger writes them that knows whole milliseconds, and is late by up to so much.
void write_whole_milliseconds(Run& run, double late) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> lateness(0, late);
  for (double& t : run.signals[Signal::omega].t.edit()) t = 1e-3 * std::floor(1e3 * (t + lateness(random)) + 0.5);
}

TEST(CountedSpeed, IsNotThatOfACoarseConverterWhoseRowsLastWholeMilliseconds) {
  emtb::Run run = converted(0.05, 2);
  write_whole_milliseconds(run, 1.5e-3);
  EXPECT_FALSE(counted_speed(std::vector{run}).has_value());
}

TEST(CountedSpeed, IsToldWhereRowsThatLastWholeMillisecondsCount) {
  emtb::Run run = converted(0.05, 0);
  write_whole_milliseconds(run, 1.5e-3);
  const Series& t = run.signals[Signal::omega];
  Series counts = t;
  for (std::size_t k = 1; k < t.t.size(); ++k) {
    const double row = t.t[k] - t.t[k - 1], step = per_line / 1320;
    counts.value.edit()[k] = step / row * std::round(t.value[k] * row / step);
  }
  run.signals[Signal::omega] = counts;
  const auto told = counted_speed(std::vector{run});
  ASSERT_TRUE(told.has_value());
  EXPECT_TRUE(told->measured_time);
  EXPECT_NEAR(told->step, per_line / 1320, 1e-9);
}

TEST(CountedSpeed, IsNotThatOfAQuietTachogeneratorWhoseSpeedSettlesBetweenSteps) {
  auto run = converted(0.23, 0);
  Series& omega = run.signals.at(Signal::omega);
  std::mt19937 random(3);
  std::normal_distribution<double> draw(0, 0.1);
  double slow = 0;
  for (std::size_t k = 0; k < omega.t.size(); ++k) {
    slow = 0.9 * slow + draw(random);
    const double steps = 8 * std::floor(2 * omega.t[k]) * (1 - std::exp(-std::fmod(omega.t[k], 0.5) / 0.02));
    omega.value.edit()[k] = 0.23 * std::round((steps + slow) / 0.23);
  }
  EXPECT_FALSE(look_at(run));
}

TEST(CountedSpeed, IsNoneWhereTheModelSaysThatATachogeneratorReadsTheSpeed) {
  emtb::Run run = counted({});
  run.signals[Signal::u_ref] = run.signals[Signal::omega];
  Model model = synthetic::servo_model();
  const auto floor_from = [&] { return prepare(std::span(&run, 1), {}, model).noise.at(Signal::omega).from; };
  EXPECT_EQ(floor_from(), FloorSource::counts);
  model.bench.tachogenerator = true;
  EXPECT_NE(floor_from(), FloorSource::counts);
}

TEST(CountedSpeed, IsNotTakenForAnAngleAcrossAGap) {
  auto run = counted({});
  Series& omega = run.signals.at(Signal::omega);
  omega.t.erase(omega.t.begin() + 100);
  omega.value.erase(omega.value.begin() + 100);
  EXPECT_FALSE(look_at(run));
}

TEST(CountedSpeed, GivesBackTheAngleThatWasCounted) {
  const Logger logger{.jitter = 0.2};
  const auto run = counted(logger);
  const auto angle = with_counted_angle(std::span(&run, 1), look_at(run).value()).front();
  EXPECT_FALSE(angle.has(Signal::omega));
  const Series& theta = angle.at(Signal::theta);
  EXPECT_DOUBLE_EQ(theta.lsb, look_at(run)->step);
  for (std::size_t k = 0; k < theta.t.size(); ++k)
    ASSERT_NEAR(theta.value[k], angle_at(theta.t[k], logger.speed), 1.01 * logger.step);
}

TEST(CountedSpeed, StandsBehindAnAngleThatWasLoggedBesideIt) {
  auto run = counted({});
  run.signals[Signal::theta] = run.at(Signal::omega);
  const auto angle = with_counted_angle(std::span(&run, 1), {.step = 1}).front();
  EXPECT_EQ(angle.at(Signal::theta).value, run.at(Signal::omega).value);
  EXPECT_FALSE(angle.has(Signal::omega));
}

TEST(CountedSpeed, OfAMeanOverRowsTheCountsOfEachRowComeBack) {
  for (const std::size_t rows : {2U, 5U, 10U, 32U}) {
    const emtb::Run each = counted({.speed = 31}), mean = averaged(each, rows);
    const auto found = look_at(mean);
    ASSERT_TRUE(found) << rows;
    EXPECT_EQ(found->rows, rows);
    EXPECT_NEAR(found->step, per_line / 1320, 1e-9);
    const emtb::Run angle = with_counted_angle(std::span(&mean, 1), *found).front();
    const emtb::Run as_counted = with_counted_angle(std::span(&each, 1), *look_at(each)).front();
    const auto &a = angle.at(Signal::theta).value, &b = as_counted.at(Signal::theta).value;
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t k = 0; k < a.size(); ++k) ASSERT_NEAR(a[k], b[k], 1e-6) << rows << ", row " << k;
  }
  EXPECT_EQ(look_at(counted({}))->rows, 1U);
}

/// Do the counts come back to the last one?
void expect_the_counts_of(const emtb::Run& each, const emtb::Run& logged, const std::string& what) {
  const auto found = look_at(logged);
  ASSERT_TRUE(found) << what;
  const emtb::Run angle = with_counted_angle(std::span(&logged, 1), *found).front();
  const emtb::Run as_counted = with_counted_angle(std::span(&each, 1), *look_at(each)).front();
  const auto &a = angle.at(Signal::theta).value, &b = as_counted.at(Signal::theta).value;
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < a.size(); ++k)
    ASSERT_NEAR(a[k], b[k], 1e-3 * found->step + 1e-4 * b[k]) << what << ", row " << k;
}

TEST(CountedSpeed, OfALoggerThatSmoothsTheCountsComeBack) {
  for (const double kept : {0.3, 0.5, 0.8, 0.95}) {
    const emtb::Run each = counted({.interval = 0.01, .step = per_line / 44, .speed = 300});
    const emtb::Run logged = smoothed(each, kept, 0.01);
    expect_the_counts_of(each, logged, "kept " + std::to_string(kept));
    EXPECT_NEAR(look_at(logged)->kept, kept, 1e-3);
  }
}

TEST(CountedSpeed, OfALoggerThatSmoothsTheMeanOfTwoRowsTheCountsComeBack) {
  const emtb::Run each = counted({.interval = 0.005, .step = per_line / 230, .speed = 90});
  expect_the_counts_of(each, smoothed(averaged(each, 2), 0.854, 1e-4), "second order");
}

TEST(CountedSpeed, IsNotThatOfASmoothedTachogenerator) {
  for (const double kept : {0.5, 0.8}) {
    for (const double digit : {1e-6, 0.01, 0.1}) {
      EXPECT_FALSE(look_at(smoothed(converted(1e-4, 500), kept, digit))) << kept << ", " << digit;
      EXPECT_FALSE(look_at(smoothed(converted(0.23, 0.3), kept, digit))) << kept << ", a coarse converter";
    }
  }
}

TEST(CountedSpeed, AMeanThatBeginsWithinAMotionIsNoneOfEachRow) {
  emtb::Run run = averaged(counted({.speed = 31}), 10);
  Series& omega = run.signals.at(Signal::omega);
  omega.t.erase(omega.t.begin(), omega.t.begin() + 100);
  omega.value.erase(omega.value.begin(), omega.value.begin() + 100);
  const auto found = look_at(run);
  EXPECT_TRUE(!found || found->rows == 1);
}

}  // namespace
}  // namespace emtb
