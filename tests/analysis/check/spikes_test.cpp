#include "analysis/check/spikes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

using testing::ElementsAre;
using testing::Field;
using testing::IsEmpty;

const auto of_the_current = ElementsAre(Field("signal", &DataFinding::signal, Signal::i_a));

TEST(Spikes, WhatAControllerSentIsNoSpike) {
  // At each count of a coarse encoder the reference jumps for a row, and 20 ms later so does the current.
  const auto counted = [](double sent) {
    emtb::Run run;
    run.name = "counted";
    synthetic::Noise noise(3);
    const auto jumps = [](double t, double delay) { return std::abs(std::remainder(t - delay - 0.2, 0.5)) < 5e-4; };
    run.signals[Signal::u_ref] = synthetic::series(1e-3, 4, [&](double t) { return 1 + (jumps(t, 0) ? sent : 0); });
    run.signals[Signal::i_a] =
        synthetic::series(1e-3, 4, [&](double t) { return (jumps(t, 0.02) ? 3 : 0.5) + noise(0.02); });
    run.signals[Signal::omega] = synthetic::series(1e-3, 4, [&](double) { return 20 + noise(0.1); });
    return run;
  };
  EXPECT_THAT(spikes(counted(0.3)), IsEmpty());
  EXPECT_THAT(spikes(counted(0)), of_the_current);
}

TEST(Spikes, ACurrentThatJumpsAsARampBeginsIsNoSpike) {
  // A driver whose output rises at light load: until the shaft turns, the first volt of a ramp makes a current.
  const auto ramped = [](double begins) {
    emtb::Run run;
    run.name = "ramped";
    synthetic::Noise noise(3);
    run.signals[Signal::u_ref] = synthetic::series(4e-3, 4, [&](double t) { return std::max(0.0, 5 * (t - begins)); });
    run.signals[Signal::i_a] = synthetic::series(4e-3, 4, [&](double t) {
      return (std::abs(t - 0.52) < 1e-3 ? 0.03 : t > 0.52 ? 0.004 : 0) + noise(1e-3);
    });
    run.signals[Signal::omega] =
        synthetic::series(4e-3, 4, [&](double t) { return std::max(0.0, 40 * (t - 0.55)) + noise(0.01); });
    return run;
  };
  EXPECT_THAT(spikes(ramped(0.518)), IsEmpty());
  EXPECT_THAT(spikes(ramped(0.2)), of_the_current) << "long after it began";
}

TEST(Spikes, AVoltageThatLeavesADeadZoneForARowIsNoSpikeWhereTheCurrentSeesItToo) {
  // A controller's noise, at rest: its reference passes the dead zone now and then. In motion the current is rough.
  const auto held = [](bool current_sees_it) {
    emtb::Run run;
    run.name = "held";
    synthetic::Noise noise(3);
    const auto passes = [](double t) { return t > 1 && std::abs(std::remainder(t - 0.2, 0.4)) < 5e-4; };
    run.signals[Signal::u_ref] = synthetic::series(2e-3, 4, [](double t) { return t < 1 ? 1.0 : 0.0; });
    run.signals[Signal::e_a] = synthetic::series(2e-3, 4, [&](double t) {
      return t < 1 ? 3 + noise(0.02) : passes(t) ? 0.13 : 0;
    });
    run.signals[Signal::i_a] = synthetic::series(2e-3, 4, [&](double t) {
      return t < 1 ? 0.5 + noise(0.05) : (passes(t) && current_sees_it ? 0.034 : 0) + noise(3e-3);
    });
    return run;
  };
  const auto of_the_voltage = ElementsAre(Field("signal", &DataFinding::signal, Signal::e_a));
  EXPECT_THAT(spikes(held(true)), IsEmpty());
  EXPECT_THAT(spikes(held(false)), of_the_voltage);
}

TEST(Spikes, ASignalThatStandsSeesNone) {
  emtb::Run run;
  run.name = "braked by nothing";
  synthetic::Noise noise(3);
  run.signals[Signal::u_ref] = synthetic::series(2e-3, 4, [](double) { return 1.0; });
  run.signals[Signal::i_a] =
      synthetic::series(2e-3, 4, [&](double t) { return (std::abs(t - 2) < 1e-3 ? 3 : 0.5) + noise(0.02); });
  EXPECT_THAT(spikes(run), of_the_current);
  run.signals[Signal::torque] = synthetic::series(2e-3, 4, [](double) { return 0.0; });
  EXPECT_THAT(spikes(run), of_the_current);
}

}  // namespace
}  // namespace emtb
