// Instruments of few steps are no flaw of a recording.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "analysis/check/check.h"
#include "analysis/check/readings.h"
#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

using testing::Contains;
using testing::Not;

auto tells(Flaw what) { return testing::Field("what", &DataFinding::what, what); }

TEST(CoarseInstruments, AVoltageThatLagsWithinACoarseStepIsNotHeld) {
  constexpr double step = 1.0575;                                  // V
  const auto lagging = [](double from, double to, double since) {  // twice
    return to + (from - to) * (1 + since / 0.155) * std::exp(-since / 0.155);
  };
  emtb::Run run;
  for (int k = 0; k < 2500; ++k) {
    const double t = 0.005 * (k - 2000), swing = 90 * std::sin(std::numbers::pi * t);
    const double u_ref = t < 0 ? swing : t < 0.5 ? 0 : t < 2 ? 53.9 : 80;
    const double e_a = t < 0.5 ? u_ref : t < 2 ? lagging(0, 54.2, t - 0.5) : lagging(54.2, 80, t - 2);
    for (const auto& [signal, value] : {std::pair{Signal::u_ref, u_ref},
                                        {Signal::e_a, step * std::round(e_a / step)},
                                        {Signal::omega, e_a + 0.1 * std::sin(1.7 * k)}}) {
      run.signals[signal].t.push_back(t + 10);
      run.signals[signal].value.push_back(value);
    }
  }
  EXPECT_THAT(check(std::vector{run}), Not(Contains(tells(Flaw::held))));
}

TEST(CoarseInstruments, ASpeedOfWholeCountsThatArithmeticBlursIsNotHeld) {
  constexpr double step = 1.7;  // rad/s
  emtb::Run run;
  Series& omega = run.signals[Signal::omega];
  omega.lsb = step;
  const auto add = [&](int steps) {
    omega.t.push_back(1e-3 * static_cast<double>(omega.t.size()));
    omega.value.push_back(step * steps * (1 + 1e-14 * steps));
  };
  for (int k = 0; k < 400; ++k) {  // by three steps at every other row, three times in a row
    for (const int more : {0, 3, 3, 6, 6, 9, 9, 8, 7, 6, 5, 4, 3, 2, 1}) add(100 + more);
  }
  EXPECT_THAT(check(std::vector{run}), Not(Contains(tells(Flaw::held))));
}

TEST(CoarseInstruments, ACurrentThatCreepsToItsPeakWithinAStepIsNotClipped) {
  constexpr double step = 2.69008482;  // A
  emtb::Run run;
  Series& i_a = run.signals[Signal::i_a];
  i_a.lsb = step;
  const auto add = [&](int steps) {
    const double t = 0.025 * static_cast<double>(i_a.t.size());
    for (const auto& [signal, value] : {std::pair{Signal::u_ref, 58.6}, {Signal::i_a, step * steps}}) {
      run.signals[signal].t.push_back(t);
      run.signals[signal].value.push_back(value);
    }
  };
  for (int k = 0; k < 400; ++k) add(30);
  // As the current of a large motor was recorded by an instrument of 8 bits.
  for (const int steps :
       {44,  45,  46,  46,  47,  47,  47,  48,  48,  48,  48,  49,  49,  49,  45,  38,  32,  28,  23,  20,
        17,  15,  12,  11,  9,   8,   7,   6,   5,   4,   4,   3,   3,   2,   2,   2,   1,   1,   1,   1,
        1,   1,   1,   1,   1,   1,   1,   0,   0,   0,   -7,  -13, -19, -23, -27, -30, -33, -36, -38, -39,
        -41, -42, -43, -44, -45, -46, -46, -47, -47, -47, -48, -48, -48, -48, -48, -48, -41, -35, -30, -25})
    add(steps);
  EXPECT_THAT(check(std::vector{run}), Not(Contains(tells(Flaw::clipped))));
}

TEST(CoarseInstruments, ASpeedThatADriversSlopeLedAndThatSettlesWithinAStepIsNotClipped) {
  constexpr double step = 1.9663849;  // rad/s
  emtb::Run run;
  Series& omega = run.signals[Signal::omega];
  const auto add = [&](int steps, int times) {
    for (int k = 0; k < times; ++k) {
      omega.t.push_back(1e-3 * static_cast<double>(omega.t.size()));
      omega.value.push_back(step * steps);
    }
  };
  add(0, 40);
  add(84, 46);
  // As a servo of 12 ms was recorded by an instrument of 8 bits.
  for (const int steps : {85,  87,  89,  92,  95,  99,  103, 107, 111, 115, 120, 125, 130, 135, 140, 145, 150,
                          155, 161, 166, 171, 177, 182, 187, 193, 199, 204, 208, 212, 215, 219, 221, 223, 225,
                          227, 228, 229, 230, 231, 232, 232, 233, 233, 234, 234, 234, 235, 235, 235})
    add(steps, 1);
  add(236, 46);
  for (const int steps : {234, 232, 230, 225, 218, 210, 199, 180, 160, 140, 125, 119}) add(steps, 1);
  add(118, 46);
  EXPECT_THAT(check(std::vector{run}), Not(Contains(tells(Flaw::clipped))));
  for (double& value : omega.value.edit()) value = std::min(value, 212 * step);
  EXPECT_THAT(check(std::vector{run}), Contains(tells(Flaw::clipped))) << "it stops as it rises";
}

TEST(CoarseInstruments, ASpeedOfCountsThatSettlesAmidACountIsNotClipped) {
  constexpr double count = 0.01404494;  // rad/s
  emtb::Run run;
  Series& omega = run.signals[Signal::omega];
  omega.lsb = count;
  const auto add = [&](int counts, int times) {
    for (int k = 0; k < times; ++k) {
      omega.t.push_back(8e-3 * static_cast<double>(omega.t.size()));
      omega.value.push_back(count * counts);
    }
  };
  add(0, 24);
  // As a linear axis was read by the counts from row to row: each hops on the way up, and stands once it has settled.
  for (const int counts :
       {-1,  -2,  -5,  -6,  -9,  -10, -11, -13, -13, -14, -15, -15, -16, -17, -16, -18, -17, -18, -17, -18,
        -18, -19, -18, -18, -19, -19, -18, -19, -19, -18, -19, -19, -19, -19, -19, -19, -19, -19, -19, -18})
    add(counts, 1);
  add(-19, 82);
  for (const int counts :
       {-17, -14, -12, -11, -9, -8, -6, -6, -5, -4, -3, -3, -3, -2, -2, -2, -1, -1, -1, -1, -1, -1, 0, -1, 0, -1})
    add(counts, 1);
  add(0, 31);
  EXPECT_THAT(check(std::vector{run}), Not(Contains(tells(Flaw::clipped))));
}

TEST(CoarseInstruments, TheOneStepOfAReferenceIsAChange) {
  emtb::Run run;
  for (int k = 0; k < 100; ++k) {
    for (const Signal signal : {Signal::u_ref, Signal::i_a}) {
      run.signals[signal].t.push_back(0.01 * k);
      run.signals[signal].value.push_back(k < 50 ? 0 : 3);
    }
  }
  const Drives drives(run, Signal::i_a);
  EXPECT_TRUE(drives.change(0.49, 0.5));
  EXPECT_FALSE(drives.change(0.6, 0.7));
}

TEST(CoarseInstruments, AProfileThatIsRecordedAgainByACoarseInstrumentIsNoDuplicate) {
  const auto ramp = [](std::uint64_t seed) {
    synthetic::Noise noise(seed);
    emtb::Run run;
    run.name = "ramp " + std::to_string(seed);
    for (int k = 0; k < 800; ++k) {
      const auto add = [&](Signal signal, double value) {
        run.signals[signal].t.push_back(0.01 * k);
        run.signals[signal].value.push_back(value);
      };
      add(Signal::u_ref, 0.01 * k);
      add(Signal::omega, std::round(0.5 * k + 0.2 + noise(0.1)));
    }
    return run;
  };
  const std::vector<emtb::Run> train{ramp(1)};
  emtb::Run other = ramp(2);
  EXPECT_THAT(check(train, std::vector{other}), Not(Contains(tells(Flaw::duplicate))));
  for (std::size_t k = 200; k < 500; ++k)
    other.signals[Signal::omega].value.edit()[k] = train[0].at(Signal::omega).value[k];
  for (std::size_t k = 500; k < 800; ++k) other.signals[Signal::omega].value.edit()[k] += 7;
  for (std::size_t k = 0; k < 200; ++k) other.signals[Signal::omega].value.edit()[k] += 7;
  EXPECT_THAT(check(train, std::vector{other}), Contains(tells(Flaw::duplicate))) << "a part of it was copied";
}

TEST(CoarseInstruments, CountsOfASteadySpeedRepeatThemselvesAndAreNoDuplicate) {
  // A driver at its limit, an encoder of 306 counts a turn, 20 Hz: the counts hop every few rows, in every run alike.
  constexpr double interval = 0.05, speed = 103.65, count = 2 * std::numbers::pi / 306;
  std::vector<emtb::Run> runs;
  for (const double wait : {0.41, 0.93, 1.725}) {
    emtb::Run run;
    run.name = "limit " + std::to_string(wait);
    double angle = 0, before = 0;
    for (int k = 0; k < 1200; ++k) {
      const double t = interval * k;
      run.signals[Signal::u_ref].t.push_back(t);
      run.signals[Signal::u_ref].value.push_back(t < wait ? 0 : 50);
      run.signals[Signal::omega].t.push_back(t);
      run.signals[Signal::omega].value.push_back((std::floor(angle / count) - std::floor(before / count)) * count /
                                                 interval);
      before = angle;
      if (t >= wait) angle += interval * speed * (1 - std::exp(-(t - wait) / 0.4));
    }
    runs.push_back(std::move(run));
  }
  EXPECT_THAT(check(runs), Not(Contains(tells(Flaw::duplicate))));
}

TEST(CoarseInstruments, AnAngleStandsUntilPowerMovesItsFirstCountWhateverTheTachogeneratorReads) {
  constexpr double count = 2 * std::numbers::pi / 70, offset = -2.2;  // rad, rad/s
  const auto readings = [](double power_until_then) {
    emtb::Run run;
    synthetic::Noise noise(5);
    const auto omega = [](double t) { return t < 0.25 ? 0 : 12 * (1 - std::exp(-(t - 0.25) / 0.17)); };
    double angle = 0;
    for (int k = 0; k < 98; ++k) {
      const double t = 0.025 * k;
      const auto add = [&](Signal signal, double value) {
        run.signals[signal].t.push_back(t);
        run.signals[signal].value.push_back(value);
      };
      add(Signal::u_ref, t < 0.25 ? power_until_then : 1.7);
      add(Signal::omega, omega(t) + offset + noise(0.15));
      add(Signal::theta, count * std::floor(angle / count));
      angle += 0.025 * omega(t);
    }
    return std::vector{run};
  };
  EXPECT_THAT(check(readings(0)), Not(Contains(tells(Flaw::held)))) << "the tachogenerator has an offset";
  EXPECT_THAT(check(readings(1)), Contains(tells(Flaw::held)));
}

}  // namespace
}  // namespace emtb
