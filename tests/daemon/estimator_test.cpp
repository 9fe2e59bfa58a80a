#include "daemon/estimator.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "session/session.h"
#include "tests/analysis/live/live_bench.h"
#include "tests/daemon/heap_guard.h"
#include "tests/process.h"
#include "tests/session/scratch.h"

namespace emtb {
namespace {

using testing::HasSubstr;
using testing::SizeIs;

/// What the loop would have told the recorder of a run.
std::vector<Record> as_records(const emtb::Run& run) {
  std::vector<Record> all;
  for (const auto& [signal, series] : run.signals) {
    for (std::size_t k = 0; k < series.t.size(); ++k) {
      all.push_back({.signal = signal, .t = series.t[k], .value = series.value[k]});
    }
  }
  std::ranges::stable_sort(all, [](const Record& a, const Record& b) {
    if (a.t != b.t) return a.t < b.t;
    return a.signal != Signal::u_ref && b.signal == Signal::u_ref;  // the reference closes a tick
  });
  return all;
}

class EstimatorTest : public testing::Test {
 protected:
  EstimatorTest() : estimator({.channels = bench.channels(), .loop_rate = bench.setup.rate}) {
    estimator.follow(bench.model);
  }
  void hand_over(const emtb::Run& run) {
    for (const Record& record : as_records(run)) estimator.feed().take(record);
  }
  /// Until it has told a change, or has seen the whole run.
  std::vector<Event> remarks_until(double t, std::uint32_t run = 0) {
    std::vector<Event> told;
    EXPECT_TRUE(eventually([&] {
      for (Event& event : estimator.remarks(run)) told.push_back(std::move(event));
      return !told.empty() || estimator.estimates()["t"] > t;
    }));
    return told;
  }

  const live_bench::LiveBench bench = live_bench::slow_live_bench();  ///< the paper's, simulated
  /// Something begins to rub: friction grows by 0.02 N m.
  const emtb::Run rubbing = live_bench::changed_run(bench, live_bench::rubbing(0.02), 1);
  Estimator estimator;
};

TEST_F(EstimatorTest, AModelThatIsSentIsMeasuredBeforeItIsFollowed) {
  const auto answer = [](Estimator& of, const Model& model) {
    const auto later = of.propose(model);
    nlohmann::json first;
    EXPECT_TRUE(eventually([&] { return !(first = later()).is_null(); }));
    return first;
  };
  EXPECT_EQ(answer(estimator, bench.model)["model"], bench.model.name);
  Estimator hasty({.channels = bench.channels(), .loop_rate = bench.setup.rate, .share = 1e-4});
  EXPECT_THAT(message_of<ModelError>([&] { answer(hasty, bench.model); }), HasSubstr("a step of it takes"));
  EXPECT_THROW(hasty.estimates(), ModelError) << "and is not followed";
}

TEST_F(EstimatorTest, RemarksAChangeForTheSessionOfItsRun) {
  hand_over(rubbing);
  const std::vector<Event> told = remarks_until(rubbing.duration() - 1);
  ASSERT_THAT(told, SizeIs(1));
  EXPECT_EQ(told[0].code, event_code::changed);
  EXPECT_GT(told[0].t, live_bench::changed_at);
  EXPECT_LT(told[0].t, live_bench::changed_at + 5);
  EXPECT_THAT(told[0].text, HasSubstr("N m s/rad more than before: does something drag on the shaft? (B; tied with "));
  EXPECT_THAT(told[0].text, HasSubstr("coulomb_friction.T_c"));  // B at one speed is like it
  nlohmann::json misfit;
  ASSERT_TRUE(eventually([&] {  // published ten times a second
    misfit = estimator.estimates()["misfit"];
    return !misfit["changes"].empty();
  }));
  EXPECT_THAT(misfit["changes"][0]["suspects"].dump(), HasSubstr("coulomb_friction.T_c"));
  EXPECT_THAT(misfit["where"], testing::Not(testing::IsEmpty()));
}

TEST_F(EstimatorTest, HasNoRemarkForTheSessionAfterIt) {
  hand_over(rubbing);
  estimator.feed().take({.kind = Record::Kind::end});
  EXPECT_TRUE(remarks_until(rubbing.duration() - 1, 1).empty());
}

TEST_F(EstimatorTest, KeepsARemarkForARecorderThatIsARunBehind) {
  estimator.feed().take({.kind = Record::Kind::end});  // of a run whose end the recorder has not come to
  hand_over(rubbing);
  EXPECT_TRUE(remarks_until(rubbing.duration() - 1, 0).empty());
  EXPECT_TRUE(eventually([&] { return !estimator.remarks(1).empty(); }));
}

TEST(EstimatorFeed, LosesAndCountsWhatFindsItFullAndKeepsRunsApart) {
  EstimatorFeed feed(4);
  HeapGuard guard;
  const auto sample = [&](double t) { feed.take({.signal = Signal::omega, .t = t, .value = 1}); };
  for (int k = 0; k < 6; ++k) sample(k);
  feed.take({.kind = Record::Kind::end});
  feed.take({.kind = Record::Kind::field, .value = 30});
  EXPECT_EQ(feed.lost(), 2U);
  EstimatorFeed::Sample got;
  for (int k = 0; k < 4; ++k) {
    ASSERT_TRUE(feed.pop(got));
    EXPECT_EQ(got.t, k);
    EXPECT_EQ(got.run, 0U);
  }
  EXPECT_FALSE(feed.pop(got));
  sample(0);
  ASSERT_TRUE(feed.pop(got));
  EXPECT_EQ(got.run, 1U) << "also where the end found it full";
  EXPECT_EQ(got.field_on, 30);
  EXPECT_EQ(guard.count(), 0U);
}

}  // namespace
}  // namespace emtb
