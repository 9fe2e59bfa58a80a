#include "analysis/record/reference_row.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

constexpr double row_time = 0.02, driver_gain = 4, slope = 32;  // s, V/V, V/s

/// A driver that moves 0.64 V from row to row.
Model slow_driver() {
  Model m = synthetic::servo_model();
  m.driver = DriverModel{.gain = driver_gain, .rise = slope, .fall = slope, .min = -24, .max = 24};
  return m;
}

/// Steps of 60 rows, and the voltage at the terminals as it was `late` rows before each row's time.
Run logged(double late) {
  constexpr std::array levels{0.0, 3.0, -2.0, 1.0, 4.0, 0.0};
  constexpr std::size_t rows_a_level = 60;
  const auto level_at = [&](double t) {
    const auto k = static_cast<std::size_t>(std::max(0.0, t / row_time)) / rows_a_level;
    return levels.at(std::min(k, levels.size() - 1));
  };
  Run run;
  run.name = "logged";
  synthetic::Noise noise(5);
  Series &u_ref = run.signals[Signal::u_ref], &e_a = run.signals[Signal::e_a];
  double voltage = 0, t = 0;
  constexpr double step = row_time / 1000;
  for (std::size_t k = 0; k < rows_a_level * levels.size(); ++k) {
    const double row = static_cast<double>(k) * row_time;
    for (; t < row - late * row_time - 1e-9; t += step) {
      const double wanted = driver_gain * level_at(t);
      voltage += std::clamp(wanted - voltage, -slope * step, slope * step);
    }
    u_ref.t.push_back(row);
    e_a.t.push_back(row);
    u_ref.value.push_back(level_at(row + 1e-6));
    e_a.value.push_back(voltage + noise(0.02));
  }
  return run;
}

double rows_after(double late) {
  const Run run = logged(late);
  return reference_acts_after(std::span(&run, 1), slow_driver()) / row_time;
}

TEST(ReferenceRow, OfAVoltageThatIsReadAmidARowIsToldByTheDriversSlope) {
  for (const double late : {0.3, 0.5, 0.65}) EXPECT_NEAR(rows_after(late), late, 0.05);
}

TEST(ReferenceRow, OfAVoltageThatIsReadInTimeIsItsOwn) { EXPECT_EQ(rows_after(0), 0); }

TEST(ReferenceRow, OfAVoltageThatIsReadARowLateIsTheNext) { EXPECT_DOUBLE_EQ(rows_after(1), 1); }

}  // namespace
}  // namespace emtb
