// What the logger's timing does is no effect: a reference that acts before or after its row is read, a channel that is
// read behind the others.
#include "analysis/fit/timing.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "analysis/diagnose/diagnose.h"
#include "tests/blind/recording.h"

namespace emtb::timing_tests {
namespace {

using testing::IsEmpty;

/// What a channel shows that is read behind the others by a part of a sample.
Series behind(Series series, double share) {
  for (std::size_t k = series.value.size(); k-- > 1;) {
    series.value[k] += share * (series.value[k - 1] - series.value[k]);
  }
  return series;
}

/// The fast bench.
class LoggedTiming : public testing::Test {
 protected:
  blind::Bench bench = blind::fast_bench();

  std::vector<emtb::Run> runs(bool held_out, double current_behind, bool read_after_the_write) const {
    std::vector<emtb::Run> all = record(bench, held_out ? bench.held_out : bench.train, held_out ? 101 : 1);
    for (emtb::Run& run : all) {
      for (auto& [signal, series] : run.signals) {
        if (signal == Signal::i_a) series = behind(std::move(series), current_behind);
        if (signal != Signal::u_ref && read_after_the_write && !series.value.empty()) {
          series.value.erase(series.value.begin());  // each row shows what came after it
          series.value.push_back(series.value.back());
        }
      }
    }
    return all;
  }
};

TEST_F(LoggedTiming, OfAChannelBehindTheOthersIsFoundAndIsNoEffect) {
  for (const double share : {0.3, 0.8}) {
    const Diagnosis d = diagnose(runs(false, share, false), runs(true, share, false), bench.model);
    EXPECT_THAT(d.missing, IsEmpty());
    EXPECT_EQ(d.verdict, Verdict::nothing_missing);
    ASSERT_TRUE(d.data->timing.late.contains(Signal::i_a));
    EXPECT_NEAR(d.data->timing.late.at(Signal::i_a), share, 0.1);
    EXPECT_LE(d.final_held_out, 1.1);
  }
}

TEST_F(LoggedTiming, OfRowsReadInTimeIsLeftAsItIs) {
  const Diagnosis d = diagnose(runs(false, 0, false), runs(true, 0, false), bench.model);
  EXPECT_THAT(d.data->timing.late, IsEmpty());
  EXPECT_EQ(d.verdict, Verdict::nothing_missing);
}

TEST_F(LoggedTiming, OfRowsReadAfterTheyWereWrittenIsNoEffect) {
  std::erase_if(bench.channels, [](const auto& c) { return c.signal == Signal::e_a; });  // it would tell the motor when
  const Diagnosis d = diagnose(runs(false, 0, true), runs(true, 0, true), bench.model);
  EXPECT_THAT(d.missing, IsEmpty());
  EXPECT_LT(d.data->timing.acts_after, 0);
  EXPECT_LE(d.final_held_out, 1.1);
}

}  // namespace
}  // namespace emtb::timing_tests
