#include "analysis/diagnose/where.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "analysis/diagnose/compare.h"
#include "tests/analysis/own_record.h"
#include "tests/blind/recording.h"

namespace emtb {
namespace {

TEST(ResidualMaps, LeaveOutTheMetersOfAHandfulOfReadings) {
  const blind::Bench bench = blind::slow_bench();
  emtb::Run run = record(bench, bench.train.front(), 1);
  for (auto& [signal, series] : run.signals) {  // its first 1.5 s: three readings of the meter
    const auto n = std::ranges::upper_bound(series.t, 1.5) - series.t.begin();
    series.t.resize(static_cast<std::size_t>(n));
    series.value.resize(static_cast<std::size_t>(n));
  }
  ASSERT_LT(run.at(Signal::i_a).t.size(), 6U);
  const Dataset data = prepare(std::vector{run}, {}, bench.model);
  const std::vector<ResidualMap> maps = residual_maps(data.train, bench.model);
  EXPECT_TRUE(std::ranges::any_of(maps, [](const ResidualMap& m) { return m.signal == Signal::omega; }));
  ASSERT_THAT(maps, testing::Not(testing::IsEmpty()));
  for (const ResidualMap& m : maps) {
    EXPECT_THAT(m.bins, testing::Not(testing::IsEmpty())) << info(m.signal).name << " against " << name_of(m.against);
    EXPECT_EQ(m.ratio.size(), m.bins.size());
  }
}

/// The map of the speed of a servo's own record whose reading errs as a function of (t, omega) says.
template <class Error>
ResidualMap map_of_speed(Condition against, const Error& error) {
  synthetic::OwnRecord own(synthetic::true_servo());
  for (const ResidualMap& m : residual_maps(own.with_error(Signal::omega, error), synthetic::true_servo())) {
    if (m.signal == Signal::omega && m.against == against) return m;
  }
  return {};
}

TEST(ResidualMaps, SayHowFarOffEachDirectionIs) {
  const ResidualMap m = map_of_speed(Condition::direction, [](double, double omega) {
    return omega > 0 ? 3.0 : omega < 0 ? -1.0 : 0.0;
  });
  EXPECT_THAT(m.bins, testing::ElementsAre(-1, 0, 1)) << "it stands at first";
  EXPECT_THAT(m.mean, testing::Pointwise(testing::DoubleNear(1e-9), {-1.0, 0.0, 3.0})) << "measured - simulated, rad/s";
  EXPECT_THAT(m.rmse, testing::Pointwise(testing::DoubleNear(1e-9), {1.0, 0.0, 3.0})) << "[rad/s]";
  constexpr double sigma = synthetic::OwnRecord::sigma_omega;
  EXPECT_THAT(m.ratio, testing::Pointwise(testing::DoubleNear(1e-9), {1 / sigma, 0.0, 3 / sigma}));
  EXPECT_NEAR(m.explained, 1, 1e-9);
  EXPECT_EQ(std::accumulate(m.count.begin(), m.count.end(), 0.0), 1000);
}

TEST(ResidualMaps, FollowAnErrorThatGrowsWithTime) {
  const ResidualMap m = map_of_speed(Condition::time, [](double t, double) { return t; });
  ASSERT_EQ(m.bins.size(), 12U);
  for (std::size_t b = 0; b < m.bins.size(); ++b) {
    EXPECT_NEAR(m.mean[b], m.bins[b], 1e-9) << "[rad/s], 1 rad/s a second";
    EXPECT_NEAR(m.bins[b], 10.0 * (static_cast<double>(b) + 0.5) / 12, 0.02) << "[s]";
    EXPECT_NEAR(m.count[b], 1000.0 / 12, 1);
  }
  EXPECT_NEAR(m.explained, 1 - 1.0 / 144, 1e-3) << "all but what is left within a twelfth of it";
}

/// How many of its bins a map's 95 % bars take away from zero, over many records whose mean residual is zero.
double share_beyond_bars(double memory) {
  constexpr int records = 40;
  double beyond = 0, bins = 0;
  for (unsigned seed = 1; seed <= records; ++seed) {
    const std::vector<double> noise = synthetic::coloured(1001, memory, seed);
    const ResidualMap m = map_of_speed(Condition::time, [&](double t, double) {
      return noise.at(static_cast<std::size_t>(std::lround(100 * t)));  // 10 s at 100 Hz
    });
    for (std::size_t b = 0; b < m.bins.size(); ++b) beyond += std::abs(m.mean[b]) > 1.96 * m.std_error[b], bins += 1;
  }
  EXPECT_EQ(bins, 12 * records);
  return beyond / bins;
}

TEST(ResidualMaps, HaveErrorsThatHoldForReadingsOneByOne) { EXPECT_LT(share_beyond_bars(0), 0.15); }

TEST(ResidualMaps, HaveErrorsThatCountReadingsNearEachOtherAsOne) {
  EXPECT_LT(share_beyond_bars(0.8), 0.25) << "with errors of independent readings it would be a half";
}

TEST(ResidualMaps, ExplainNothingOfWhatDoesNotHangOnTheCondition) {
  const ResidualMap m =
      map_of_speed(Condition::speed, [](double t, double) { return std::lround(100 * t) % 2 == 0 ? 2.5 : 1.5; });
  ASSERT_GT(m.bins.size(), 5U);
  for (std::size_t b = 0; b < m.bins.size(); ++b) {
    EXPECT_NEAR(m.mean[b], 2, 1.5 / std::sqrt(m.count[b]));
    EXPECT_NEAR(m.rmse[b], std::sqrt(4.25), 1.5 / std::sqrt(m.count[b]));
  }
  EXPECT_LT(m.explained, 0.03);
}

TEST(ResidualMaps, PutTheMostTellingConditionOfASignalFirst) {
  synthetic::OwnRecord own(synthetic::true_servo());
  const auto curved = [](double, double omega) { return 1e-4 * omega * std::abs(omega); };
  const std::vector<ResidualMap> maps = residual_maps(own.with_error(Signal::omega, curved), synthetic::true_servo());
  const auto first = std::ranges::find(maps, Signal::omega, &ResidualMap::signal);
  ASSERT_NE(first, maps.end());
  EXPECT_EQ(first->against, Condition::speed);
  EXPECT_GT(first->explained, 0.98);
}

}  // namespace
}  // namespace emtb
