#include "analysis/live/steady_mean.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

TEST(SteadyMean, CountsAChangeThatIsExpectedAsItIsAndNotInTheMeanThatFollows) {
  const std::vector<double> noise = synthetic::coloured(2000, 0, 3);
  SteadyMean mean;
  double given = 0;
  for (std::size_t k = 0; k < 1000; ++k) given = mean.next(1 + 0.01 * noise[k]);
  EXPECT_NEAR(given, 1, 2e-3);
  mean.expect_change(200);
  for (std::size_t k = 1000; k < 2000; ++k) {
    const double way = std::min(1.0, static_cast<double>(k - 1000) / 200);  // 0.02 within 200 readings: less than noise
    const double x = 1 + 0.02 * way + 0.01 * noise[k];
    given = mean.next(x);
    if (k < 1200) {
      EXPECT_EQ(given, x);
    }
  }
  EXPECT_NEAR(given, 1.02, 2e-3);
}

}  // namespace
}  // namespace emtb
