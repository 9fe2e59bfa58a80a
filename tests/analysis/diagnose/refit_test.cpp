#include "analysis/diagnose/refit.h"

#include <gtest/gtest.h>

#include "analysis/diagnose/moves.h"
#include "analysis/record/dataset.h"
#include "model/catalogue.h"
#include "tests/blind/recording.h"

namespace emtb {
namespace {

const CalibrationOptions one_start{.extra_starts = 0};

Dataset recorded_on(const blind::Bench& bench) {
  return prepare(blind::record(bench, bench.train, 1), {}, bench.model);
}

TEST(BegunRefitWith, EndsNoWorseThanTheModelWithoutTheEffect) {
  blind::Bench bench = blind::slow_bench();
  bench.plant.friction.T_c = 0.05;  // [N m]
  const Dataset data = recorded_on(bench);
  const Fit base = calibrate(data.train, bench.model, one_start);
  for (const std::size_t effect : absent_effects(base.model)) {
    const EffectInfo& about = base.model.about(effect);
    const bool there_or_not = about.at_null == AtNull::nothing || about.parameter_count == 0;
    if (!makes_sense(effect, base.model) || about.is_wave() || there_or_not) continue;
    const Fit begun = begun_refit_with(data.train, base, bench.model, effect);
    EXPECT_LE(begun.cost, 1.01 * base.cost) << about.id;  // a heat capacity is at most so large
  }
}

TEST(BegunRefitWith, FindsALimitThatTheModelWithoutItHasBentAwayFrom) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.driver.current_limit = 3;  // [A] of 20 that a step would draw
  std::vector<emtb::Run> speeds = blind::record(bench, bench.train, 1);
  for (emtb::Run& run : speeds) {
    for (const Signal read : {Signal::i_a, Signal::e_a}) run.signals.erase(read);
  }
  bench.model.base[base::R_a].fixed = true;
  const Dataset data = prepare(speeds, {}, bench.model);
  const Fit base = calibrate(data.train, bench.model, one_start);
  const Fit begun = begun_refit_with(data.train, base, bench.model, effect_index("current_limit"));
  EXPECT_LT(begun.cost, 0.1 * base.cost);
}

}  // namespace
}  // namespace emtb
