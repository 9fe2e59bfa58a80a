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

}  // namespace
}  // namespace emtb
