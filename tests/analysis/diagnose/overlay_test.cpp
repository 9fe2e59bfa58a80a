#include "analysis/diagnose/overlay.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "analysis/diagnose/compare.h"
#include "tests/blind/recording.h"

namespace emtb {
namespace {

class Overlays : public testing::Test {
 protected:
  Overlays() : bench(blind::slow_bench()) {
    const std::vector<Run> runs{record(bench, bench.train.front(), 1)};
    data = prepare(runs, {}, bench.model);
    list = overlays(data.train.front(), bench.model);
  }
  using Run = emtb::Run;  // not testing::Test::Run

  const Overlay& of(Signal signal) const { return *std::ranges::find(list, signal, &Overlay::signal); }

  blind::Bench bench;
  Dataset data;
  std::vector<Overlay> list;
};

TEST_F(Overlays, AreAsFarOffAsTheComparisonSays) {
  ASSERT_EQ(list.size(), data.train.front().observations.size());
  const std::map<Signal, SignalFit> fits = fit_of(data.train, bench.model, data.noise);
  ASSERT_EQ(fits.size(), list.size());
  for (const auto& [signal, fit] : fits) {
    EXPECT_NEAR(of(signal).floors(), fit.ratio, 1e-9 * fit.ratio) << info(signal).name;
    double squares = 0;
    for (const double r : of(signal).residual()) squares += r * r;
    EXPECT_NEAR(std::sqrt(squares / static_cast<double>(of(signal).t.size())), fit.rmse, 1e-9 * fit.rmse);
  }
}

TEST_F(Overlays, ShowASlowMetersReadingsAsTheMeansThatTheyAre) {
  const Overlay& meter = of(Signal::i_a);
  ASSERT_TRUE(meter.slow);
  ASSERT_FALSE(meter.t.empty());
  for (std::size_t i = 0; i < meter.t.size(); ++i) EXPECT_NEAR(meter.t[i] - meter.from[i], 0.4, 0.01) << "at 2.5 Hz";
  const Overlay& tacho = of(Signal::omega);
  EXPECT_FALSE(tacho.slow);
  EXPECT_EQ(tacho.from, tacho.t);
}

}  // namespace
}  // namespace emtb
