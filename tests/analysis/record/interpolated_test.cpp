#include "analysis/record/interpolated.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "analysis/record/record.h"
#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

constexpr double row = 0.02, until = 40;  // [s]

double rounded(double value) { return std::round(value * 1000) / 1000; }

/// Readings of every so many-th row, and rows on the straight line between them, as a table holds them.
Series put_into_rows(std::size_t rows, std::size_t first, double noise) {
  synthetic::Noise by(3);
  const double apart = row * static_cast<double>(rows), begin = row * static_cast<double>(first);
  std::vector<double> readings;
  for (double t = begin - apart; t < until + apart; t += apart) readings.push_back(std::sin(2 * t) + by(noise));
  return synthetic::series(row, until, [&](double t) {
    const double place = (t - begin) / apart + 1, before = std::floor(place + 1e-9);
    const auto k = static_cast<std::size_t>(before);
    return rounded(readings[k] + (place - before) * (readings[k + 1] - readings[k]));
  });
}

/// What a servo's speed does without noise, whose reference steps every so many rows.
Series smooth_between_steps(std::size_t rows) {
  const double apart = row * static_cast<double>(rows);
  double speed = 0;
  return synthetic::series(row, until, [&](double t) {
    const auto step = static_cast<int>(t / apart + 1e-9);
    return speed += 0.1 * ((step % 2 == 0 ? 100.0 : 20.0 + step) - speed);
  });
}

TEST(Interpolated, RowsAreToldByTheirStraightLines) {
  for (const std::size_t rows : {3U, 5U, 10U, 40U}) {
    for (const double noise : {0.0, 0.02}) {
      const StraightRows told = straight_rows(put_into_rows(rows, 1, noise));
      EXPECT_EQ(told.rows, rows) << noise;
      EXPECT_EQ(told.first, 1U) << noise;
    }
  }
}

TEST(Interpolated, RowsAreToldWhereTheirDigitsSayAllOfTheLines) {
  Series coarse = put_into_rows(5, 1, 0.02);
  std::vector<double> value = coarse.value;
  for (std::size_t k = 1; k + 5 < value.size(); k += 5) {
    const auto to_hundredths = [](double x) { return std::round(x * 100) / 100; };
    const double from = to_hundredths(value[k]), to = to_hundredths(value[k + 5]);
    for (std::size_t j = 0; j < 5; ++j) value[k + j] = from + 0.2 * static_cast<double>(j) * (to - from);
    value[k + 5] = to;
  }
  coarse.value = value;
  EXPECT_EQ(straight_rows(coarse).rows, 5U);
}

TEST(Interpolated, AreNotABriefMotionOfAQuietSignal) {
  synthetic::Noise by(6);
  const Series quiet = synthetic::series(row, until, [&](double t) {
    const double within = std::fmod(t, 2);
    return (within > 1 && within < 1.06 ? 5.0 : 0.0) + by(0.01);
  });
  EXPECT_EQ(straight_rows(quiet).rows, 1U);
}

TEST(Interpolated, AreNotWhatWasReadInEachRow) {
  synthetic::Noise by(4);
  const auto read = [](const std::function<double(double)>& of) { return synthetic::series(row, until, of); };
  EXPECT_EQ(straight_rows(read([&](double t) { return rounded(std::sin(2 * t) + by(0.01)); })).rows, 1U);
  EXPECT_EQ(straight_rows(read([](double t) { return std::sin(2 * t); })).rows, 1U);
  EXPECT_EQ(straight_rows(read([](double t) { return std::round(20 * std::sin(2 * t)) / 20; })).rows, 1U);
  EXPECT_EQ(straight_rows(read([](double t) { return std::sin(2 * (t - std::fmod(t, 5 * row))); })).rows, 1U);
  EXPECT_EQ(straight_rows(read([](double) { return 3.0; })).rows, 1U);
  for (const std::size_t rows : {10U, 25U, 50U}) EXPECT_EQ(straight_rows(smooth_between_steps(rows)).rows, 1U);
}

TEST(Interpolated, LeavesTheReadings) {
  const Series series = put_into_rows(5, 1, 0.02), readings = without_straight_rows(series);
  ASSERT_EQ(readings.t.size(), (series.t.size() + 3) / 5);
  EXPECT_EQ(readings.t[2], series.t[11]);
  EXPECT_EQ(readings.value[2], series.value[11]);
}

/// A motor under its own voltage, with a current as it stands in the rows.
Observation current_of(const Series& current) {
  Model model = synthetic::servo_model();
  model.input = Signal::e_a;
  emtb::Run run;
  run.name = "rows";
  run.signals[Signal::e_a] = synthetic::series(row, until, [](double t) { return 5 + std::sin(2 * t); });
  run.signals[Signal::omega] = synthetic::series(row, until, [](double t) { return 90 + std::sin(2 * t); });
  run.signals[Signal::i_a] = current;
  return *observe_run(run, model).find(Signal::i_a);
}

TEST(Interpolated, RowsAreNotCompared) {
  const Observation current = current_of(put_into_rows(5, 1, 0.02));
  EXPECT_EQ(current.functional, Functional::instant);
  EXPECT_EQ(current.size(), 400U);
  EXPECT_EQ(current.last[2], 11U);
}

TEST(Interpolated, MeansThatALoggerRepeatsKeepTheirWindow) {
  synthetic::Noise by(5);
  double mean = 0;
  int k = 0;
  Series held = synthetic::series(row, until, [&](double t) {
    if (k++ % 5 == 0) mean = rounded(std::sin(2 * t) + by(0.02));
    return mean;
  });
  held.window = 0.1;
  const Observation current = current_of(held);
  EXPECT_EQ(current.functional, Functional::mean);
  EXPECT_LE(current.size(), 400U);
  EXPECT_GE(current.size(), 398U);
  EXPECT_EQ(current.last[2] - current.first[2], 5U);
  EXPECT_EQ(current.last[2] % 5, 0U);
}

}  // namespace
}  // namespace emtb
