#include "session/gaps.h"

#include <gtest/gtest.h>

#include <numeric>

#include "tests/analysis/check/planted.h"

namespace emtb {
namespace {

Run even_run(double seconds, double interval) {
  Run run{.name = "even.csv", .signals = {}};
  for (const Signal s : {Signal::u_ref, Signal::omega}) {
    for (int k = 0; k * interval < seconds; ++k) {
      run.signals[s].t.push_back(k * interval);
      run.signals[s].value.push_back(k);
    }
  }
  return run;
}

class Gaps : public testing::Test {
 protected:
  using Run = emtb::Run;  // not testing::Test::Run
};

TEST_F(Gaps, ARunWithoutAGapStaysWhole) {
  const Run run = even_run(2, 0.01);
  const auto pieces = split_at_gaps(run, Signal::u_ref);
  ASSERT_EQ(pieces.size(), 1u);
  EXPECT_EQ(pieces[0].name, run.name);
  EXPECT_EQ(pieces[0].at(Signal::omega).t, run.at(Signal::omega).t);
}

TEST_F(Gaps, AHundredSecondsWithoutReadingsMakeTwoRunsThatStartAtZero) {
  Run run = even_run(4, 0.01);
  planted::pause(run, 1.995, 100);
  const auto pieces = split_at_gaps(run, Signal::u_ref);
  ASSERT_EQ(pieces.size(), 2u);
  EXPECT_EQ(pieces[0].name, "even.csv@:101.995");
  EXPECT_EQ(pieces[1].name, "even.csv@101.995:") << "a span that could be typed";
  EXPECT_EQ(pieces[0].at(Signal::omega).t.size(), 200u);
  EXPECT_NEAR(pieces[1].at(Signal::omega).t.front(), 0.005, 1e-9);
  EXPECT_EQ(pieces[1].at(Signal::omega).value.front(), 200);
  EXPECT_LT(pieces[1].duration(), 2.01);
}

TEST_F(Gaps, AFewLostRowsAreNoGap) {
  Run run = even_run(4, 0.01);
  planted::hole(run, 1.005, 1.045);
  EXPECT_TRUE(gaps(run.at(Signal::u_ref).t).empty());
  EXPECT_EQ(split_at_gaps(run, Signal::u_ref).size(), 1u);
}

TEST_F(Gaps, OfSeveralTheLargestIsWhereItWas) {
  Run run = even_run(4, 0.01);
  planted::hole(run, 1.005, 1.995);
  planted::hole(run, 3.005, 3.195);
  const auto found = gaps(run.at(Signal::u_ref).t);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_NEAR(found[0].from, 1, 1e-9);
  EXPECT_NEAR(found[0].to, 2, 1e-9);
  EXPECT_EQ(split_at_gaps(run, Signal::u_ref).size(), 3u);
}

TEST_F(Gaps, BurstsWithAnHourBetweenThemAreRunsOfTheirOwn) {
  Run run = even_run(4, 0.02);
  for (auto& [signal, series] : run.signals) {
    for (std::size_t k = 0; k < series.t.size(); ++k) series.t.edit()[k] += 3600.0 * static_cast<double>(k / 20);
  }
  EXPECT_EQ(split_at_gaps(run, Signal::u_ref).size(), 10u);
}

TEST_F(Gaps, AGapInAnOutputAloneSplitsNothing) {
  Run run = even_run(4, 0.01);
  Run holed = run;
  planted::hole(holed, 1, 2);
  run.signals[Signal::omega] = holed.at(Signal::omega);
  EXPECT_EQ(split_at_gaps(run, Signal::u_ref).size(), 1u);
}

}  // namespace
}  // namespace emtb
