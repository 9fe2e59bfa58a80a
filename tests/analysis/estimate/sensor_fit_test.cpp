#include "analysis/estimate/sensor_fit.h"

#include <gmock/gmock.h>

#include <vector>

#include "hal/error.h"

namespace emtb {
namespace {

using ::testing::HasSubstr;

std::string refused(const std::vector<SensorPoint>& points, double lsb = 1e-3) {
  try {
    fit_sensor(points, lsb, 0.02);
  } catch (const SessionError& e) {
    return e.what();
  }
  return "";
}

TEST(SensorFit, FindsScaleAndOffsetOfALine) {
  const std::vector<SensorPoint> points{{.value = 1, .raw = 0}, {.value = 41, .raw = 2}, {.value = 101, .raw = 5}};
  const SensorFit fit = fit_sensor(points, 1e-3, 0.02);
  EXPECT_DOUBLE_EQ(fit.scale, 20);
  EXPECT_NEAR(fit.offset, 1, 1e-12);
  EXPECT_NEAR(fit.residual, 0, 1e-12);
}

TEST(SensorFit, SaysHowFarThePointsLieOffTheLine) {
  const std::vector<SensorPoint> points{
      {.value = 0, .raw = 0}, {.value = 51, .raw = 2.5}, {.value = 99, .raw = 5}, {.value = 150, .raw = 7.5}};
  const SensorFit fit = fit_sensor(points, 1e-3, 0.02);
  EXPECT_NEAR(fit.scale, 19.92, 1e-9);
  EXPECT_NEAR(fit.offset, 0.3, 1e-9);
  EXPECT_NEAR(fit.residual, 0.948683, 1e-6) << "squares 0.09 0.81 0.81 0.09 over 4 - 2 points";
}

TEST(SensorFit, RefusesNonsense) {
  EXPECT_THAT(refused({{.value = 1, .raw = 1}}), HasSubstr("two points at least"));
  EXPECT_THAT(refused({{.value = 5, .raw = 1}, {.value = 5, .raw = 2}}), HasSubstr("references are the same"));
  EXPECT_THAT(refused({{.value = 0, .raw = 1}, {.value = 100, .raw = 1.005}}), HasSubstr("Is it wired"));
  EXPECT_THAT(refused({{.value = 0, .raw = 1, .scatter = 0.1}, {.value = 100, .raw = 1.5}}), HasSubstr("Is it wired"));
  EXPECT_THAT(refused({{.value = 0, .raw = 0}, {.value = 150, .raw = 5}, {.value = 200, .raw = 10}}),
              HasSubstr("point 2 (150) is 33.33 off the line"));
}

}  // namespace
}  // namespace emtb
