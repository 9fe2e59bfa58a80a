#include "analysis/check/beyond_driver.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/analysis/synthetic.h"

namespace emtb::beyond_driver_tests {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

/// Of a driver of four volts to one, that ends at 24 V.
DataFindings asked_for(double volts) {
  emtb::Run run = synthetic::record({}, {{0.2, 1}, {0.2, volts / 4}, {0.2, 0}}, 1e-3, {.omega = 0.1});
  run.name = "brake.csv";
  return beyond_driver(std::span(&run, 1), synthetic::servo_model());
}

TEST(BeyondTheDriver, IsRemarkedOfAReferenceThatTheDriverCannotGiveByFar) {
  const DataFindings findings = asked_for(-96);
  ASSERT_THAT(findings, SizeIs(1));
  EXPECT_THAT(findings[0].text, HasSubstr("asks for 96 V, where the model's driver ends at 24 V"));
  EXPECT_FALSE(findings[0].stops) << "a controller may ask for as much";
  EXPECT_EQ(findings[0].what, Flaw::scale);
  EXPECT_NEAR(findings[0].from, 0.2, 2e-3);
}

TEST(BeyondTheDriver, IsNothingOfOneThatSaturatesNowAndThen) { EXPECT_THAT(asked_for(30), IsEmpty()); }

TEST(BeyondTheDriver, IsNotKnownWhereTheModelStatesNoLimit) {
  emtb::Run run = synthetic::record({}, {{0.2, 1}, {0.2, 1000}}, 1e-3, {.omega = 0.1});
  Model model = synthetic::servo_model();
  model.driver.reset();
  EXPECT_THAT(beyond_driver(std::span(&run, 1), model), IsEmpty());
}

}  // namespace
}  // namespace emtb::beyond_driver_tests
