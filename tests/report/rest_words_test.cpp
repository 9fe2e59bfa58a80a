#include "report/rest_words.h"

#include <gmock/gmock.h>

#include <cmath>

#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

/// A speed that is 1.4 mrad/s off, 700 times what its instrument leaves.
SignalFit far_off() {
  SignalFit fit;
  fit.noise.sigma = 2e-6;
  fit.rmse = 1.4e-3;
  fit.ratio = 700;
  fit.fit_percent = 98.3;
  fit.rest = {.rms = 1.4e-3, .lasts = 0.4, .like = 0.012, .applied = 0.4};
  return fit;
}

TEST(WhatIsLeft, IsToldInTheTermsOfTheMachineBeforeMultiplesOfAFloor) {
  EXPECT_EQ(
      in_words(Signal::omega, far_off()),
      "speed wrong by 1.4 mrad/s rms (fit 98.3 %); the instrument explains 0.002; the rest lasts 0.4 s and is like "
      "a torque of 12 mN m (3 % of that applied); 700 noise floors");
}

TEST(WhatIsLeft, HasNoMultiplesOfAFloorThatIsOnlyABound) {
  SignalFit fit = far_off();
  fit.noise.upper_bound = true;
  EXPECT_THAT(in_words(Signal::omega, fit), AllOf(HasSubstr("explains 0.002 at most"), Not(HasSubstr("floors"))));
  EXPECT_THAT(signals_text({{Signal::omega, fit}}), Not(HasSubstr("700")));
}

TEST(WhatIsLeft, IsNoTorqueWhereItIsAnotherInEachReading) {
  SignalFit fit = far_off();
  fit.rest = {.rms = 1.4e-3, .hops = true};
  EXPECT_THAT(in_words(Signal::omega, fit),
              AllOf(HasSubstr("the rest is another in each reading, as noise is"), Not(HasSubstr("torque"))));
}

TEST(WhatIsLeft, IsTheInstrumentsWhereNothingIsLeftBesideIt) {
  SignalFit fit = far_off();
  fit.ratio = 0.99;
  fit.rest = {};
  EXPECT_THAT(in_words(Signal::i_a, fit),
              AllOf(HasSubstr("current wrong by 1.4 mA"), HasSubstr("the instrument explains all of it"),
                    Not(HasSubstr("rest"))));
}

TEST(WhatIsLeft, IsNoInstrumentsWhereTheSimulationBlowsUp) {
  SignalFit fit = far_off();
  fit.rmse = std::nan("");
  fit.rest = {};
  EXPECT_EQ(in_words(Signal::i_a, fit), "current cannot be compared: its simulation leaves all bounds");
}

TEST(WhatIsLeft, HasNoFitWhereNothingMoves) {
  SignalFit fit = far_off();
  fit.moves = false;
  fit.fit_percent = 0;
  EXPECT_THAT(in_words(Signal::torque, fit), AllOf(HasSubstr("(it does not move)"), Not(HasSubstr("0 %"))));
  EXPECT_THAT(signals_text({{Signal::torque, fit}}), Not(HasSubstr("0 %")));
}

TEST(ScaledUnit, KeepsNumbersShort) {
  EXPECT_EQ(with_scaled_unit(0.0234, "A"), "23 mA");
  EXPECT_EQ(with_scaled_unit(0.5, "V"), "0.5 V");
  EXPECT_EQ(with_scaled_unit(3.4e-5, "N m"), "34 uN m");
  EXPECT_EQ(with_scaled_unit(123, "rad/s", 3), "123 rad/s");
  EXPECT_EQ(with_scaled_unit(0, "V"), "0 V");
}

TEST(TimingInWords, SaysInOneLineWhenRowsWereReadAndWritten) {
  const Model model = synthetic::servo_model();
  EXPECT_EQ(in_words(Timing{}, 0.005, model), "the reference acts from its row on");
  EXPECT_EQ(in_words(Timing{.acts_after = -5e-6, .late = {}}, 0.005, model),
            "the reference acts before the readings of its row");
  EXPECT_EQ(in_words(Timing{.acts_after = -5e-6, .rows_early = 1, .late = {}}, 0.005, model),
            "the reference acts before the readings of the row before its own");
  EXPECT_EQ(
      in_words(Timing{.acts_after = 2.5e-3, .late = {{Signal::i_a, 0.4}}}, 0.005, model),
      "the reference acts after the readings of its row, by 0.5 of a sample; current is read 0.4 of a sample late");
  Model by_voltage = model;
  by_voltage.input = Signal::e_a;
  EXPECT_THAT(in_words(Timing{.acts_after = 0, .held = true, .late = {}}, 0.005, by_voltage),
              HasSubstr("holds until the next"));
}

}  // namespace
}  // namespace emtb
