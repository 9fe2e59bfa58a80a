#include "analysis/estimate/first_spin.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace emtb {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr double spin_u = 1;         // [V]
constexpr double spin_R_a = 31.8;    // [ohm]
constexpr double spin_K_b = 0.67;    // [V s/rad]
constexpr double spin_gain = 18.33;  // [V/V]
constexpr double spin_i_a = 0.08;    // [A] of friction alone

/// A healthy first spin, each signal through a gain and an offset of its own.
struct Instrument {
  double gain = 1;
  double offset = 0;
};
emtb::Run spun(Instrument e_a = {}, Instrument i_a = {}, Instrument omega = {}, bool turns = true) {
  emtb::Run run;
  const auto add = [&](Signal signal, Instrument through, double value, double every, double window) {
    Series& series = run.signals[signal];
    series.window = window;
    for (double t = every; t < 10; t += every) {
      const bool on = t - window > 2 && t < 8;
      series.t.push_back(t);
      series.value.push_back(through.gain * (on ? value : 0) + through.offset);
    }
  };
  const double voltage = spin_gain * spin_u;
  const double current = turns ? spin_i_a : voltage / spin_R_a;
  add(Signal::e_a, e_a, voltage, 1e-2, 0);
  add(Signal::i_a, i_a, current, 0.4, 0.4);
  add(Signal::omega, omega, (voltage - spin_R_a * current) / spin_K_b, 1e-2, 0);
  return run;
}

std::vector<std::string> wrong(const emtb::Run& run) {
  return judge_first_spin(
             run, {.u_ref = spin_u, .from = 2, .to = 8, .R_a = spin_R_a, .K_b = spin_K_b, .driver_gain = spin_gain})
      .wrong;
}

TEST(FirstSpin, FindsNothingWrongWithAHealthyBench) {
  EXPECT_THAT(wrong(spun()), IsEmpty());
  EXPECT_THAT(wrong(spun({1.05}, {0.9, 0.002}, {1.1, 0.5})), IsEmpty()) << "as real instruments are";
}

TEST(FirstSpin, NamesTheOneWireOrScaleThatIsWrong) {
  EXPECT_THAT(wrong(spun({-1})), ElementsAre(HasSubstr("e_a reads -18.3 V, not 18.3 V: its sign is wrong")));
  EXPECT_THAT(wrong(spun({0})), ElementsAre(HasSubstr("no voltage arrives")));
  EXPECT_THAT(wrong(spun({0.5})), ElementsAre(HasSubstr("its scale is off by a factor of 0.5")));
  EXPECT_THAT(wrong(spun({}, {-1})), ElementsAre(HasSubstr("i_a reads -0.08 A while the driver drives: its sign")));
  EXPECT_THAT(wrong(spun({}, {0})), ElementsAre(HasSubstr("is the meter in the armature circuit")));
  EXPECT_THAT(wrong(spun({}, {1000})), ElementsAre(HasSubstr("its scale is too large")));
  EXPECT_THAT(wrong(spun({}, {}, {-1})), ElementsAre(HasSubstr("omega reads -23.6 rad/s, not 23.6 rad/s: its sign")));
  EXPECT_THAT(wrong(spun({}, {}, {0})), ElementsAre(HasSubstr("the motor turns, the tacho says not")));
  EXPECT_THAT(wrong(spun({}, {}, {9.55})), ElementsAre(HasSubstr("off by a factor of 9.55"))) << "rpm for rad/s";
  EXPECT_THAT(wrong(spun({}, {}, {1, 20})), ElementsAre(HasSubstr("omega reads 20 rad/s while the motor stands")));
  EXPECT_THAT(wrong(spun({}, {}, {}, false)), ElementsAre(HasSubstr("the motor does not turn")));
}

TEST(FirstSpin, SaysWhatItCouldNotCheck) {
  emtb::Run run = spun();
  run.signals.erase(Signal::i_a);
  const SpinVerdict verdict = judge_first_spin(run, {.u_ref = spin_u, .from = 2, .to = 8});
  EXPECT_THAT(verdict.wrong, IsEmpty());
  EXPECT_THAT(verdict.unknown, testing::SizeIs(3)) << "i_a, and two scales without a nameplate";
}

}  // namespace
}  // namespace emtb
