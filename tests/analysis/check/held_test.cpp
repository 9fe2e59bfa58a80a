#include "analysis/check/held.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>
#include <vector>

#include "analysis/check/check.h"
#include "tests/analysis/synthetic.h"
#include "tests/blind/recording.h"

namespace emtb {
namespace {

using testing::Contains;
using testing::Not;

MATCHER(IsAHeldCurrent, "") { return arg.what == Flaw::held && arg.signal == Signal::i_a; }

TEST(Held, IsACurrentThatFreezesAtASmallValueWhereTheDriveGoesOn) {
  const blind::Bench servo = blind::fast_bench();
  std::vector<emtb::Run> runs = record(servo, servo.train, 3);
  const std::span<double> current = runs[3].signals.at(Signal::i_a).value.edit();  // under random steps
  const double largest = std::abs(std::ranges::max(current, {}, [](double i) { return std::abs(i); }));
  const std::size_t count = current.size() / 3;
  const auto small = std::ranges::find_if(current, [&](double i) { return i > 0.02 * largest && i < 0.04 * largest; });
  ASSERT_LT(small, current.end() - static_cast<std::ptrdiff_t>(count));
  std::fill_n(small, count, *small);
  EXPECT_THAT(check(runs, {}, &servo.model), Contains(IsAHeldCurrent()));
}

TEST(Held, IsNotACurrentThatStaysWhereAControllerRests) {
  // It hunts while the controller does, and stays while the voltage ramps: its own noise is below its step.
  emtb::Run run;
  run.name = "positions";
  synthetic::Noise noise(3);
  Series &voltage = run.signals[Signal::e_a], &current = run.signals[Signal::i_a], &angle = run.signals[Signal::theta];
  for (int k = 0; k < 3000; ++k) {
    const double t = 4e-3 * k;
    const bool ramps = k % 300 > 240;
    const double e = ramps ? 8 - 0.08 * (k % 300 - 240) : 3 * std::sin(1.3 * t) + noise(0.8);
    for (Series* s : {&voltage, &current, &angle}) s->t.push_back(t);
    voltage.value.push_back(e);
    current.value.push_back(0.0028 * std::round((ramps ? -0.039 : e / 26 + 0.05) / 0.0028));
    angle.value.push_back(3 * std::sin(0.4 * t) + (ramps ? 1e-3 * (k % 300) : 0));
  }
  EXPECT_THAT(check(std::vector{run}, {}, nullptr), Not(Contains(IsAHeldCurrent())));
}

TEST(Held, IsNoSpeedThatAControllerKeepsUnderALoadThatGrows) {
  emtb::Run run;
  run.name = "setpoint";
  synthetic::Noise noise(5);
  Series &reference = run.signals[Signal::u_ref], &current = run.signals[Signal::i_a],
         &speed = run.signals[Signal::omega];
  for (int k = 0; k < 600; ++k) {
    const double load = k < 250 ? 0.5 : 0.5 + 0.01 * (k - 250);
    const double since = std::max(0, k - 20) / 10.0, turning = 50 * (1 - std::exp(-since / 3) * std::cos(since));
    for (Series* s : {&reference, &current, &speed}) s->t.push_back(5e-3 * k);
    current.value.push_back(load + noise(0.02));
    reference.value.push_back(0.1 * turning + current.value.back());
    speed.value.push_back(std::round(turning));
  }
  for (const DataFinding& f : check(std::vector{run}, {}, nullptr)) EXPECT_FALSE(f.stops) << f.text;
}

TEST(Held, IsNoSpeedWhosePulsesComeAtTheRateOfTheRows) {
  emtb::Run run;
  run.name = "slotted disc";
  constexpr double pulse = 2 * std::numbers::pi / 20;                                            // [rad]
  constexpr std::array rates{153, 284, 400, 657, 971, 1130, 643, 233, 517, 711, 843, 371, 590};  // [1/s]
  synthetic::Noise noise(7);
  Series &reference = run.signals[Signal::u_ref], &speed = run.signals[Signal::omega];
  double t = 0, turned = 0.5, rate = 0;  // of 400 a second, 14 come in 35 ms and 16 in 40 ms
  for (std::size_t k = 0; k < 1500; ++k) {
    const double goal = rates[k / 40 % rates.size()];
    const double row = 0.04 + 0.005 * std::clamp(std::round(noise(0.8)), -1.0, 1.0);  // [s]
    rate += 0.5 * (goal - rate);
    const double before = std::floor(turned);
    t += row;
    turned += rate * row + noise(0.05);
    for (Series* s : {&reference, &speed}) s->t.push_back(t);
    reference.value.push_back(0.02 * goal);
    speed.value.push_back(0.1 * std::round(10 * (std::floor(turned) - before) * pulse / row));
  }
  for (const DataFinding& f : check(std::vector{run}, {}, nullptr)) EXPECT_FALSE(f.stops) << f.text;
}

}  // namespace
}  // namespace emtb
