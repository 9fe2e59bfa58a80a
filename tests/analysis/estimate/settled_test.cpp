#include "analysis/estimate/settled.h"

#include <gmock/gmock.h>

#include <cmath>

#include "hal/error.h"
#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

using synthetic::series;
using testing::HasSubstr;

/// 5 s at rest, up within 2 s, 8 s at 100 rad/s, then an exponential to 50.
double speed(double t) {
  if (t < 5) return 0;
  if (t < 7) return 50 * (t - 5);
  if (t < 15) return 100;
  return 50 + 50 * std::exp(-(t - 15) / 0.3);
}

emtb::Run plateaus(double sigma) {
  synthetic::Noise noise(7);
  emtb::Run run;
  run.name = "plateaus";
  run.signals[Signal::omega] = series(4e-3, 22, [&](double t) { return speed(t) + noise(sigma); });
  run.signals[Signal::i_a] = series(0.4, 22, [](double t) { return 0.1 + 0.01 * t; });
  run.signals[Signal::i_a].window = 0.4;
  return run;
}

TEST(Settled, FindsThePlateausAndNothingElse) {
  for (const double sigma : {0.0, 0.2, 2.0}) {
    const emtb::Run run = plateaus(sigma);
    const Settled settled = settled_points(std::span(&run, 1));
    ASSERT_EQ(settled.points.size(), 3U) << sigma;
    const double from[] = {0, 7, 15}, to[] = {5, 15, 22}, level[] = {0, 100, 50};
    for (std::size_t k = 0; k < 3; ++k) {
      const SettledPoint& p = settled.points[k];
      EXPECT_GE(p.where.from, from[k]);
      EXPECT_LE(p.where.to, to[k]);
      EXPECT_GT(p.where.to - p.where.from, 0.6 * (to[k] - from[k])) << "most of it is used";
      EXPECT_NEAR(p.at(Signal::omega), level[k], 0.05 + 4 * p.error(Signal::omega));
      const auto n = static_cast<double>(p.mean.at(Signal::omega).readings);
      EXPECT_NEAR(p.error(Signal::omega), sigma / std::sqrt(n), 0.4 * sigma / std::sqrt(n) + 0.01);
    }
  }
}

TEST(Settled, ASlowReadingCountsWhereItsWindowLiesWithin) {
  const emtb::Run run = plateaus(0);
  const Settled settled = settled_points(std::span(&run, 1), {.chosen = {{8, 9.3}, {10.1, 10.5}}});
  ASSERT_EQ(settled.points.size(), 2U);
  EXPECT_EQ(settled.points[0].mean.at(Signal::i_a).readings, 3U) << "those of 8.4, 8.8 and 9.2 s";
  EXPECT_NEAR(settled.points[0].at(Signal::i_a), 0.188, 1e-12);
  EXPECT_FALSE(settled.points[1].has(Signal::i_a)) << "10.4 s is the mean since 10.0";
}

TEST(Settled, ARampIsNotSettledHoweverSlow) {
  emtb::Run run;
  run.signals[Signal::omega] = series(4e-3, 60, [](double t) { return 2 * t; });
  EXPECT_TRUE(settled_points(std::span(&run, 1)).points.empty());
}

TEST(Settled, ColouredNoiseWidensTheError) {
  const std::vector<double> coloured = synthetic::coloured(5000, 0.9, 3);
  emtb::Run run;
  std::size_t k = 0;
  run.signals[Signal::omega] = series(4e-3, 20, [&](double) { return 100 + coloured[k++]; });
  const Mean mean = mean_over(run.at(Signal::omega), 0, 20);
  EXPECT_NEAR(mean.std_error, std::sqrt(1.9 / 0.1 / 5000), 0.015);
}

TEST(Settled, RefusesAStretchThatNoRunHas) {
  const emtb::Run run = plateaus(0);
  try {
    settled_points(std::span(&run, 1), {.chosen = {{20, 30}}});
    FAIL();
  } catch (const SessionError& e) {
    EXPECT_THAT(e.what(), HasSubstr("20:30"));
  }
}

}  // namespace
}  // namespace emtb
