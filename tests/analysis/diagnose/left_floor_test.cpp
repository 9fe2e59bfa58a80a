#include "analysis/diagnose/left_floor.h"

#include <gtest/gtest.h>

#include "tests/analysis/synthetic.h"

namespace emtb::left_floor {
namespace {

/// Readings so far apart that the current moves more between two of them than it scatters.
Dataset restless() {
  std::vector<synthetic::Hold> plan{{0.1, 0}};
  for (int k = 0; k < 60; ++k) plan.push_back({0.06, 1.0 + (k * 7 % 11) * 0.3});
  emtb::Run run = synthetic::record({}, plan, 0.02, {.omega = 0.05, .i_a = 0.002});
  return prepare(std::vector{run}, {}, synthetic::servo_model());
}

Model truth() {
  Model model = synthetic::servo_model();
  const synthetic::Truth motor;
  const double exact[] = {motor.R_a, motor.K_b, motor.K_m, motor.B, motor.J};
  for (std::size_t i = 0; i < model.base.size(); ++i) model.base[i].value = exact[i];
  return model;
}

TEST(FloorThatAModelLeaves, IsTheMostThatAFloorCanBe) {
  const Dataset data = restless();
  ASSERT_GT(data.noise.at(Signal::i_a).sigma, 0.004) << "so that there is something to take down";
  const auto quieter = floors_down_to_what_is_left(data, truth());
  ASSERT_TRUE(quieter);
  EXPECT_NEAR(quieter->at(Signal::i_a).sigma, 0.002, 0.0005);
}

TEST(FloorThatAModelLeaves, StaysWhereTheModelLeavesMoreOrTheFloorWasDeclared) {
  Dataset data = restless();
  Model wrong = truth();
  wrong.at(base::K_b).value *= 2;
  const auto quieter = floors_down_to_what_is_left(data, wrong);
  const Noise& after = quieter ? *quieter : data.noise;
  EXPECT_EQ(after.at(Signal::i_a).sigma, data.noise.at(Signal::i_a).sigma);
  for (auto& [signal, floor] : data.noise) floor.from = FloorSource::declared;
  EXPECT_FALSE(floors_down_to_what_is_left(data, truth()));
}

}  // namespace
}  // namespace emtb::left_floor
