#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "model/catalogue.h"
#include "model/dual.h"
#include "tests/model/benches.h"
#include "tests/model/check_sensitivities.h"

namespace emtb {
namespace {

using testing_benches::fast_bench;
using testing_benches::slow_bench;
using testing_benches::TestBench;

/// How large the effects of a case are.
enum class Size { null, typical };

/// A bench with effects, in the order of the catalogue.
SensitivityCase case_of(const TestBench& bench, const std::vector<std::pair<std::size_t, Size>>& effects) {
  SensitivityCase c{bench.structure, {}, bench.excitation};
  for (std::size_t i = 0; i < bench.base.size(); ++i) {
    c.parameters.push_back({std::string(base_parameters[i].symbol), bench.base[i], bench.base[i], 0, 1e9});
  }
  for (const auto& [effect, size] : effects) {
    c.structure.effects.push_back(effect);
    for (const EffectParameter& p : effect_catalogue()[effect].parameters()) {
      const std::string name = std::string(effect_catalogue()[effect].id) + "." + std::string(p.symbol);
      const double typical = bench.typical.at(name);
      const double value = size == Size::null ? std::min(p.null, p.max) : typical;
      c.parameters.push_back({name, value, std::abs(typical), p.min, p.max});
    }
  }
  return c;
}

/// With measured voltage and load: a little off what the model would do, as measurements are.
SensitivityCase staged(SensitivityCase c, bool voltage, bool load, double voltmeter = 1.01) {
  std::vector<double> values;
  for (const CheckedParameter& p : c.parameters) values.push_back(p.value);
  Trajectory<double> y;
  simulate<double>(c.structure, values, c.excitation, y);
  if (voltage) {
    c.structure.measured_voltage = true;
    for (const double e : y.e_a) c.excitation.e_a.push_back(voltmeter * e);
  }
  if (load) {
    c.structure.measured_load = true;
    const double fastest = *std::ranges::max_element(y.omega);
    const double stall = values[base::K_m] / values[base::R_a] * *std::ranges::max_element(y.e_a);
    for (std::size_t k = 0; k < y.omega.size(); ++k) {
      // A brake in the middle of the run; at the end something pulls in the direction of the motion.
      const double share = c.excitation.t[k] / c.excitation.t.back();
      c.excitation.load.push_back((share < 0.3 ? 0 : share < 0.8 ? 0.1 : -0.02) * stall * y.omega[k] / fastest);
      c.excitation.omega.push_back(0.99 * y.omega[k]);
    }
  }
  return c;
}

// ---- every effect of the catalogue

using EffectCase = std::tuple<std::size_t, std::string>;

class EffectSensitivities : public testing::TestWithParam<EffectCase> {
 protected:
  std::size_t effect() const { return std::get<0>(GetParam()); }
  TestBench bench() const { return std::get<1>(GetParam()) == "slow" ? slow_bench() : fast_bench(); }
};

/// Where the shaft sticks at some angles and slips at others, or rings, or the bridge blocks between two rows,
/// differences are no better than this.
double tolerance_of(std::size_t effect) {
  const std::string_view id = effect_catalogue()[effect].id;
  if (id == "cogging" || id == "shaft_compliance") return 0.02;
  return id == "pwm_drive" ? 1e-4 : 1e-5;
}

TEST_P(EffectSensitivities, AreRightWhereTheEffectIsAbsent) {
  if (effect_catalogue()[effect()].fades()) GTEST_SKIP() << "it fades, and is tried as it stands";
  EXPECT_TRUE(CheckSensitivities(case_of(bench(), {{effect(), Size::null}})));
}

TEST_P(EffectSensitivities, AreRightAtATypicalSize) {
  EXPECT_TRUE(CheckSensitivities(case_of(bench(), {{effect(), Size::typical}}), tolerance_of(effect())));
}

TEST_P(EffectSensitivities, AreRightBesideDryFriction) {
  const std::string_view id = effect_catalogue()[effect()].id;
  if (id == "cogging" || id == "spring_load") GTEST_SKIP() << "where it comes to rest hangs on a hair";
  const std::size_t coulomb = effect_index("coulomb_friction");
  const std::size_t other = effect() == coulomb ? effect_index("windage") : coulomb;
  for (const Size size : {Size::null, Size::typical}) {
    if (size == Size::null && effect_catalogue()[effect()].fades()) continue;
    std::vector<std::pair<std::size_t, Size>> effects{{other, Size::typical}, {effect(), size}};
    std::ranges::sort(effects);
    EXPECT_TRUE(CheckSensitivities(case_of(bench(), effects), tolerance_of(effect())));
  }
}

TEST_P(EffectSensitivities, AreRightWhereVoltageAndLoadAreMeasured) {
  // At rest without any load, an offset of the gauge to either side is a brake that holds: a kink.
  const bool kinks = effect_catalogue()[effect()].id == "torque_offset";
  if (!effect_catalogue()[effect()].fades() && !kinks) {
    EXPECT_TRUE(CheckSensitivities(staged(case_of(bench(), {{effect(), Size::null}}), true, true)));
  }
  // Where the driver begins to block, the current jumps by what the voltmeter is off.
  const std::string_view id = effect_catalogue()[effect()].id;
  const bool blocks = id == "one_quadrant_driver" || id == "coasting_driver";
  EXPECT_TRUE(CheckSensitivities(
      staged(case_of(bench(), {{effect(), Size::typical}}), true, !blocks, blocks ? 1 : 1.01), tolerance_of(effect())));
}

std::vector<std::size_t> all_effects() {
  std::vector<std::size_t> all(effect_count);
  for (std::size_t i = 0; i < effect_count; ++i) all[i] = i;
  return all;
}

INSTANTIATE_TEST_SUITE_P(Catalogue, EffectSensitivities,
                         testing::Combine(testing::ValuesIn(all_effects()), testing::Values("slow", "fast")),
                         [](const auto& test) {
                           return std::string(effect_catalogue()[std::get<0>(test.param)].id) + "_" +
                                  std::get<1>(test.param);
                         });

// ---- the base model

TEST(BaseSensitivities, AreRightForEveryWayOfDrivingTheMotor) {
  for (const TestBench& bench : {slow_bench(), fast_bench()}) {
    SCOPED_TRACE(bench.name);
    const SensitivityCase base = case_of(bench, {});
    EXPECT_TRUE(CheckSensitivities(base));
    for (const auto& [voltage, load] : {std::pair(true, false), std::pair(false, true), std::pair(true, true)}) {
      EXPECT_TRUE(CheckSensitivities(staged(base, voltage, load)));
    }
    SensitivityCase from_voltage = staged(base, true, false);
    from_voltage.structure.input = Signal::e_a;
    from_voltage.excitation.u_ref.clear();
    EXPECT_TRUE(CheckSensitivities(from_voltage));
    SensitivityCase current_drive = base;
    current_drive.structure.input = Signal::i_a;
    std::swap(current_drive.excitation.i_a, current_drive.excitation.u_ref);
    EXPECT_TRUE(CheckSensitivities(current_drive));
    SensitivityCase opened = base;
    for (const double t : opened.excitation.t)
      opened.excitation.armature_open.push_back(t > 0.7 * opened.excitation.t.back());
    EXPECT_TRUE(CheckSensitivities(opened));
  }
}

TEST(BaseSensitivities, AreRightWithEveryEffectAtOnce) {
  for (const TestBench& bench : {slow_bench(), fast_bench()}) {
    SCOPED_TRACE(bench.name);
    std::vector<std::pair<std::size_t, Size>> all;
    for (const std::size_t effect : all_effects()) {
      // All but those that make every later moment hang on a hair: angles that hold, play, blocking, ringing.
      const std::string_view id = effect_catalogue()[effect].id;
      if (id == "cogging" || id == "eccentric_load" || id == "spring_load" || id == "backlash" ||
          id == "one_quadrant_driver" || id == "coasting_driver" || id == "pwm_drive" || id == "shaft_compliance") {
        continue;
      }
      all.emplace_back(effect, Size::typical);
    }
    EXPECT_TRUE(CheckSensitivities(case_of(bench, all)));
  }
}

// ---- the check itself

TEST(CheckSensitivities, FailsForADerivativeThatIsWrong) {
  const SensitivityCase c = case_of(fast_bench(), {{effect_index("windage"), Size::typical}});
  const Sensitivities right = model_sensitivities(c);
  const Sensitivities differences = difference_sensitivities(c);
  ASSERT_TRUE(agree(c, right, differences, 1e-5));
  for (std::size_t p = 0; p < right.size(); ++p) {
    Sensitivities wrong = right;
    for (double& d : wrong[p].omega) d *= 1.0001;
    EXPECT_FALSE(agree(c, wrong, differences, 1e-5)) << "a scale that is off by 0.01 %";
    wrong = right;
    const std::size_t late = right[p].omega.size() * 3 / 4;
    const double largest =
        std::abs(*std::ranges::max_element(right[p].omega, {}, [](double d) { return std::abs(d); }));
    wrong[p].omega[late] += 1e-4 * largest;
    EXPECT_FALSE(agree(c, wrong, differences, 1e-5)) << "a single moment";
    wrong = right;
    std::ranges::fill(wrong[p].i_a, 0);
    EXPECT_FALSE(agree(c, wrong, differences, 1e-5)) << "a signal that was forgotten";
  }
}

// ---- the arithmetic

template <class F>
void expect_derivative(const F& f, double x) {
  const double step = 1e-5 * std::max(1.0, std::abs(x));
  const double expected = (value_of(f(Dual<4>(x + step))) - value_of(f(Dual<4>(x - step)))) / (2 * step);
  const Dual<4> y = f(Dual<4>::variable(x, 2));
  EXPECT_NEAR(y.d[2], expected, 1e-8 * std::max(1.0, std::abs(expected)));
  EXPECT_EQ(y.d[0], 0);
  EXPECT_EQ(y.d[3], 0);
}

TEST(Dual, FollowsTheRulesOfDifferentiation) {
  using D = Dual<4>;
  for (const double x : {-2.0, -0.3, 0.4, 3.0}) {
    SCOPED_TRACE(x);
    expect_derivative([](D a) { return a + a * 2 + 3 + 4 * a; }, x);
    expect_derivative([](D a) { return 1 - a - a * a - 2; }, x);
    expect_derivative([](D a) { return a / (a * a + 1); }, x);
    expect_derivative([](D a) { return 3 / a; }, x);
    expect_derivative([](D a) { return a / 7; }, x);
    expect_derivative([](D a) { return -exp(a * 0.5); }, x);
    expect_derivative([](D a) { return sin(a * 3); }, x);
    expect_derivative([](D a) { return abs(a) * a; }, x);
    expect_derivative([](D a) { return larger(a * a, D(1.0)) + smaller(a, D(0.5)); }, x);
    expect_derivative([](D a) { return clamped(a, D(-1.0), a * 0.5 + 1); }, x);
    expect_derivative([](D a) { return soft_threshold(a, D(0.35)); }, x);
    expect_derivative([](D a) { return saturation(a * 2); }, x);
    expect_derivative([](D a) { return soft_threshold(D(2.5), a); }, std::abs(x));
    expect_derivative([](D a) { return decay(0.1, a); }, x);
    expect_derivative([](D a) { return first_order_lag(a, 0.1, D(1.0), a * 2, D(0.3)); }, std::abs(x));
  }
}

TEST(SoftThreshold, WithoutAThresholdLetsEverythingPass) {
  using D = Dual<4>;
  // A shaft at rest without dry friction: the slightest torque moves it, and the derivative must say so.
  EXPECT_EQ(soft_threshold(D::variable(0, 1), D(0.0)).d[1], 1);
  EXPECT_EQ(soft_threshold(D::variable(0, 1), D(0.5)).d[1], 0);
  EXPECT_EQ(soft_threshold(D(0.0), D::variable(0, 1)).d[1], 0);  // friction alone moves nothing
}

}  // namespace
}  // namespace emtb
