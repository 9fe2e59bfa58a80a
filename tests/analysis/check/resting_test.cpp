#include "analysis/check/resting.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

TEST(Resting, IsNoShortRunThatGoesUpAndStaysThere) {
  const auto going_to = [](double speed) {
    emtb::Run run;
    run.name = "short";
    synthetic::Noise noise(3);
    run.signals[Signal::u_ref] = synthetic::series(2e-2, 1, [](double) { return 6.0; });
    run.signals[Signal::omega] =
        synthetic::series(2e-2, 1, [&](double t) { return speed * (1 - std::exp(-t / 0.1)) + noise(20); });
    return std::vector{run};
  };
  const auto of_the_speed = testing::Contains(testing::Field(&DataFinding::signal, Signal::omega));
  EXPECT_THAT(resting(going_to(840)), testing::Not(of_the_speed));
  EXPECT_THAT(resting(going_to(0)), of_the_speed);
}

TEST(Resting, IsACurrentThatWasTypedInOnceForEachRun) {
  std::vector<emtb::Run> runs;
  for (const double current : {0.35, 0.43}) {
    emtb::Run run;
    run.name = "typed in";
    run.signals[Signal::e_a] = synthetic::series(2e-2, 2, [](double t) { return t < 0.2 ? 0.0 : 6.0; });
    run.signals[Signal::omega] = synthetic::series(2e-2, 2, [](double t) { return 800 * (1 - std::exp(-t / 0.1)); });
    run.signals[Signal::i_a] = synthetic::series(2e-2, 2, [current](double) { return current; });
    runs.push_back(std::move(run));
  }
  const auto of_the_current = testing::Contains(testing::Field(&DataFinding::signal, Signal::i_a));
  EXPECT_THAT(resting(runs), of_the_current);
  for (emtb::Run& run : runs) run.signals.erase(Signal::e_a);  // the drive may hold the current
  EXPECT_THAT(resting(runs), testing::Not(of_the_current));
}

}  // namespace
}  // namespace emtb
