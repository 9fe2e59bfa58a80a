#include "analysis/check/between_runs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "analysis/check/balance.h"
#include "analysis/check/check.h"
#include "analysis/check/windows.h"
#include "tests/analysis/check/planted.h"
#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

struct Motor {
  double R_a = 2.2, K = 0.4, V_b = 0;
};

/// A motor in both directions, at voltages up to the one given.
emtb::Run driven(const std::string& name, double voltage, const Motor& m) {
  constexpr double B = 5e-4, J = 1.07e-2, T_c = 0.05, dt = 1e-3;
  synthetic::Noise noise(name.back());
  emtb::Run run;
  run.name = name;
  double omega = 0;
  for (int k = 0; k < 12000; ++k) {
    const double e = voltage * std::array{0.0, 0.5, 1.0, -0.3, -0.8, 0.3}.at(static_cast<std::size_t>(k / 2000));
    const double i = (e - m.K * omega - m.V_b * std::tanh(omega)) / m.R_a;
    omega += dt * (m.K * i - B * omega - T_c * std::tanh(omega)) / J;
    const auto read = [&](Signal signal, double value, double by) {
      synthetic::add_reading(run, signal, k * dt, value + noise(by));
    };
    read(Signal::e_a, e, 0.01);
    read(Signal::i_a, i, 5e-3);
    read(Signal::omega, omega, 0.05);
  }
  return run;
}

DataFindings other_scales(const std::vector<emtb::Run>& runs) {
  DataFindings stopping = check(runs);
  std::erase_if(stopping, [](const DataFinding& f) { return !f.stops; });
  return stopping;
}

MATCHER_P3(IsOtherScale, run, signal, text, "") {
  return arg.what == Flaw::scale && arg.run == run && arg.signal == signal && arg.text.find(text) != std::string::npos;
}

TEST(ScalesBetweenRuns, NameTheRunAndTheSignalThatIsInAnotherUnit) {
  const std::vector<emtb::Run> good{driven("a", 60, {}), driven("b", 30, {}), driven("c", 45, {})};
  ASSERT_THAT(other_scales(good), IsEmpty());
  const auto with = [&](Signal signal, double factor) {
    std::vector<emtb::Run> runs = good;
    planted::scale(runs[1], signal, factor);
    return other_scales(runs);
  };
  EXPECT_THAT(with(Signal::omega, 30 / std::numbers::pi), ElementsAre(IsOtherScale("b", Signal::omega, "in rpm")));
  EXPECT_THAT(with(Signal::i_a, 10), ElementsAre(IsOtherScale("b", Signal::i_a, "10 times")));
  EXPECT_THAT(with(Signal::i_a, 1000), ElementsAre(IsOtherScale("b", Signal::i_a, "mA")));
  EXPECT_THAT(with(Signal::e_a, 10), ElementsAre(IsOtherScale("b", Signal::e_a, "10 times")));
}

TEST(ScalesBetweenRuns, OfTwoRunsNameOneThatTheOtherContradicts) {
  std::vector<emtb::Run> runs{driven("a", 60, {}), driven("b", 30, {})};
  planted::scale(runs[0], Signal::omega, 30 / std::numbers::pi);
  EXPECT_THAT(other_scales(runs), ElementsAre(IsOtherScale("a", Signal::omega, "the other run")));
}

TEST(ScalesBetweenRuns, AreTheSameForBrushesThatTakeMostOfALowVoltage) {
  const Motor brushes{.V_b = 4};
  EXPECT_THAT(other_scales({driven("a", 60, brushes), driven("b", 7, brushes), driven("c", 55, brushes)}), IsEmpty());
}

TEST(ScalesBetweenRuns, AreTheSameForAHotArmature) {
  EXPECT_THAT(other_scales({driven("a", 60, {}), driven("b", 60, {.R_a = 3.3}), driven("c", 45, {})}), IsEmpty());
}

TEST(ScalesBetweenRuns, RemarkARunOfAnotherMotor) {
  DataFindings found =
      check(std::vector{driven("a", 60, {}), driven("b", 30, {.R_a = 1.6, .K = 0.34}), driven("c", 45, {})});
  std::erase_if(found, [](const DataFinding& f) { return f.run.empty(); });
  ASSERT_EQ(found.size(), 1);
  EXPECT_EQ(found[0].run, "b");
  EXPECT_FALSE(found[0].stops);
  EXPECT_THAT(found[0].text, HasSubstr("K_b = 0.34 V s/rad here, 0.4 in the other runs"));
}

TEST(MotionWindows, AreThoseOfALogInWhichEachSignalHasRowsOfItsOwn) {
  emtb::Run run = driven("events", 60, {});
  const auto keep = [&](Signal signal, std::size_t every, std::size_t first) {
    Series& s = run.signals.at(signal);
    Series kept;
    for (std::size_t k = first; k < s.t.size(); k += every) kept.t.push_back(s.t[k]), kept.value.push_back(s.value[k]);
    s = std::move(kept);
  };
  keep(Signal::omega, 5, 1);
  keep(Signal::i_a, 7, 2);
  ASSERT_TRUE(is_sparse(run, Signal::omega));
  const MotorConstants constants = constants_of(motion_windows(run));
  EXPECT_NEAR(constants.back_emf.value, 0.4, 0.02);
  EXPECT_NEAR(constants.resistance.value, 2.2, 0.2);
}

TEST(Swapped, ColumnsOfVoltageAndCurrentAreNamed) {
  std::vector<emtb::Run> runs{driven("a", 60, {}), driven("b", 30, {})};
  std::swap(runs[1].signals.at(Signal::e_a), runs[1].signals.at(Signal::i_a));
  const DataFindings found = other_scales(runs);
  ASSERT_EQ(found.size(), 1);
  EXPECT_EQ(found[0].run, "b");
  EXPECT_THAT(found[0].text, HasSubstr("e_a and i_a seem to be swapped"));
}

}  // namespace
}  // namespace emtb
