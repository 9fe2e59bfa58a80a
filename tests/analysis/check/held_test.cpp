#include "analysis/check/held.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
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

}  // namespace
}  // namespace emtb
