#include "analysis/diagnose/where.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "analysis/diagnose/compare.h"
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
  for (const ResidualMap& m : maps) {
    EXPECT_THAT(m.bins, testing::Not(testing::IsEmpty())) << info(m.signal).name << " against " << name_of(m.against);
    EXPECT_EQ(m.ratio.size(), m.bins.size());
  }
}

}  // namespace
}  // namespace emtb
