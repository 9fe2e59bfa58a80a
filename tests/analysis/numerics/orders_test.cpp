#include "analysis/numerics/orders.h"

#include <gmock/gmock.h>

#include <cmath>

#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

using testing::IsEmpty;
using testing::SizeIs;

/// One second at each speed, 200 readings: a ripple of the given order and amplitude, its phase different each time.
std::vector<TurningStretch> stretches(const std::vector<double>& speeds, double order, double amplitude, double sigma,
                                      double rho = 0) {
  std::vector<TurningStretch> all;
  unsigned seed = 1;
  for (const double speed : speeds) {
    const std::vector<double> noise = synthetic::coloured(200, rho, seed++);
    TurningStretch s;
    for (std::size_t k = 0; k < noise.size(); ++k) {
      s.angle.push_back(speed * static_cast<double>(k) / 200);
      s.value.push_back(speed + amplitude * std::sin(order * s.angle.back() + seed) + sigma * noise[k]);
    }
    all.push_back(s);
  }
  return all;
}

TEST(StrongOrders, FindsARippleThroughNoise) {
  const auto orders = strong_orders(stretches({60, 80, 100, 120, 150}, 3, 0.5, 0.4), 4);
  ASSERT_THAT(orders, SizeIs(1));
  EXPECT_NEAR(orders[0].per_turn, 3, 0.02);
  EXPECT_NEAR(orders[0].amplitude, 0.5, 0.05);
}

TEST(StrongOrders, TellsAnOrderBeyondTheSamplingWhereTheSpeedVaries) {
  // 200 readings a second at 150 rad/s are 8 a turn: 6.5 waves a turn look like 1.9. At other speeds they do not.
  const auto orders = strong_orders(stretches({83, 97, 118, 131, 150}, 6.5, 0.5, 0.3), 4);
  ASSERT_FALSE(orders.empty());
  EXPECT_NEAR(orders[0].per_turn, 6.5, 0.02);
}

TEST(StrongOrders, SeesNoneInNoiseOfAnyColour) {
  for (const double rho : {0.0, 0.5, 0.9, 0.97}) {
    EXPECT_THAT(strong_orders(stretches({60, 80, 100, 120, 150, 60, 80, 100, 120, 150}, 1, 0, 0.4, rho), 4), IsEmpty())
        << rho;
  }
  EXPECT_THAT(strong_orders({}, 4), IsEmpty());
  EXPECT_THAT(strong_orders(stretches({1, 2, 3}, 5, 1, 0.1), 4), IsEmpty()) << "it hardly turns";
}

TEST(RemoveOrders, LeavesTheNoise) {
  auto all = stretches({60, 80, 100, 120, 150}, 3, 0.5, 0.1);
  const auto orders = strong_orders(all, 4);
  ASSERT_THAT(orders, SizeIs(1));
  for (TurningStretch& s : all) {
    remove_orders(s, orders);
    double mean = 0, squares = 0;
    for (const double v : s.value) mean += v / static_cast<double>(s.value.size());
    for (const double v : s.value) squares += (v - mean) * (v - mean);
    EXPECT_NEAR(std::sqrt(squares / static_cast<double>(s.value.size())), 0.1, 0.02);
    EXPECT_NEAR(mean, s.angle.back() * 200 / 199, 0.1) << "the mean is no order";
  }
}

}  // namespace
}  // namespace emtb
