#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "model/catalogue.h"
#include "tests/model/step_bench.h"

namespace emtb {
namespace {

// Steps that need nothing but their sums are made many at a time: they end where single ones do.

using namespace step_bench;

/// Of a machine, and of what moves it by its first four parameters.
Trajectory<Sensitive> sensitive(const ModelStructure& structure, const std::vector<double>& values,
                                const Excitation& x) {
  std::vector<Sensitive> p(values.begin(), values.end());
  for (std::size_t i = 0; i < derivatives_per_pass; ++i) p[p.size() - 1 - i].d[i] = 1;
  Trajectory<Sensitive> y;
  simulate<Sensitive>(structure, p, x, y);
  return y;
}

/// The largest difference over the largest that there is: of the values, and of each derivative.
double apart(const std::vector<Sensitive>& a, const std::vector<Sensitive>& b) {
  double worst = 0;
  for (std::size_t j = 0; j <= derivatives_per_pass; ++j) {
    const auto part = [j](const Sensitive& y) { return j == 0 ? y.v : y.d[j - 1]; };
    double difference = 0, most = 1e-12;
    for (std::size_t k = 0; k < a.size(); ++k) {
      difference = std::max(difference, std::abs(part(a[k]) - part(b[k])));
      most = std::max(most, std::abs(part(b[k])));
    }
    worst = std::max(worst, difference / most);
  }
  return worst;
}

class ManySteps : public testing::TestWithParam<std::size_t> {};

TEST_P(ManySteps, EndWhereSingleOnesDo) {
  constexpr double rounding = 1e-9;
  const EffectInfo& about = effect_catalogue()[GetParam()];
  for (const bool measured : {false, true}) {
    ModelStructure structure = with({"coulomb_friction"}, measured ? Signal::e_a : Signal::u_ref);
    structure.measured_voltage = measured;
    std::vector<double> values = and_(servo, {0.003});
    if (about.id != "coulomb_friction") {
      structure.effects.push_back(GetParam());
      for (const EffectParameter& p : about.parameters()) values.push_back(p.typical);
    }
    Excitation many = holds(1e-3, {{0.05, 2}, {0.1, 8}, {0.06, 0}, {0.2, -6}, {0.05, 0.05}});
    if (measured) many.e_a = many.u_ref;
    Excitation single = many;
    single.armature_open.assign(many.t.size(), 0);  // closed throughout; row by row, since it is asked for
    const Trajectory<Sensitive> at_once = sensitive(structure, values, many),
                                in_turn = sensitive(structure, values, single);
    EXPECT_LT(apart(at_once.omega, in_turn.omega), rounding) << measured;
    EXPECT_LT(apart(at_once.i_a, in_turn.i_a), rounding) << measured;
    EXPECT_LT(apart(at_once.e_a, in_turn.e_a), rounding) << measured;
    EXPECT_LT(apart(at_once.theta, in_turn.theta), rounding) << measured;
    EXPECT_LT(apart(at_once.torque, in_turn.torque), rounding) << measured;
  }
}

INSTANTIATE_TEST_SUITE_P(Catalogue, ManySteps, testing::Range(std::size_t{0}, effect_count),
                         [](const auto& effect) { return std::string(effect_catalogue()[effect.param].id); });

}  // namespace
}  // namespace emtb
