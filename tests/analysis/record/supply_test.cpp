#include "analysis/record/supply.h"

#include <gtest/gtest.h>

#include "analysis/record/dataset.h"
#include "tests/analysis/synthetic.h"

namespace emtb::supply_tests {
namespace {

std::vector<emtb::Run> up_to_three_volts() {
  return {synthetic::record({}, {{0.2, 1}, {0.2, -3}, {0.2, 0}}, 1e-3, {.omega = 0.1, .i_a = 0.01, .e_a = 0.02})};
}

TEST(Supply, IsTheLimitThatTheModelFileStates) {
  const Model model = synthetic::servo_model();
  EXPECT_EQ(supply_of(prepare(up_to_three_volts(), {}, model).train, model), 24);
}

TEST(Supply, IsTheOneLimitThatIsStatedWhereTheOtherIsNot) {
  EXPECT_EQ(DriverModel{.max = 9}.supply(), 9);
  EXPECT_EQ((DriverModel{.min = -9}).supply(), 9);
  EXPECT_EQ((DriverModel{.min = 0, .max = 9}).supply(), 9);
  EXPECT_EQ(DriverModel{.min = 0}.supply(), DriverModel::unlimited) << "a driver of one direction";
}

TEST(Supply, IsElseTheLargestVoltageOfAnyRecord) {
  Model model = synthetic::servo_model();
  model.driver->min = -DriverModel::unlimited;
  model.driver->max = DriverModel::unlimited;
  const Dataset data = prepare(up_to_three_volts(), {}, model);
  EXPECT_NEAR(supply_of(data.train, model), 12, 0.1) << "four times the reference, or as it was read";
  const Prior known = known_of_supply(data.train, model);
  EXPECT_EQ(known.value, supply_of(data.train, model));
  EXPECT_GT(known.std, 0.1 * known.value);
  EXPECT_LT(known.std, 0.3 * known.value);
}

}  // namespace
}  // namespace emtb::supply_tests
