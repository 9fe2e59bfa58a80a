// A field winding that stays warm from one run to the next.

#include <gtest/gtest.h>

#include <cmath>

#include "analysis/fit/calibrate.h"
#include "analysis/record/dataset.h"
#include "tests/analysis/live/live_bench.h"

namespace emtb {
namespace {

using namespace live_bench;

class FieldOn : public testing::Test {
 protected:
  static constexpr double drop = 0.06;
  static constexpr double tau = 20;  // [s]

  FieldOn() {
    bench.setup.plant.motor.field_drop = drop;
    bench.setup.plant.motor.field_time = tau;
    std::vector<Knot> knots{{0, 0}};
    for (int k = 0; k < 24; ++k) {
      const double level = std::vector{0.0, 4.0, 2.0, -5.0}[static_cast<std::size_t>(k) % 4];
      knots.push_back({5.0 * k, level});
      knots.push_back({5.0 * (k + 1), level});
    }
    whole = simulated::record(bench.setup, Profile("long", knots), 1);
    bench.model.include(heating);
  }

  /// From t0 to t1, as a run of its own, which begins at rest.
  emtb::Run part(double t0, double t1) const {
    emtb::Run run{.name = "part", .signals = {}, .field_on = t0};
    for (const auto& [signal, series] : whole.signals) {
      Series own{.t = {}, .value = {}, .window = series.window, .lsb = series.lsb, .source = series.source};
      for (std::size_t k = 0; k < series.t.size(); ++k) {
        if (series.t[k] < t0 || series.t[k] >= t1) continue;
        own.t.push_back(series.t[k] - t0);
        own.value.push_back(series.value[k]);
      }
      run.signals[signal] = own;
    }
    return run;
  }

  const std::size_t heating = effect_index("field_heating");
  LiveBench bench = fast_live_bench();
  emtb::Run whole;
};

TEST_F(FieldOn, ACalibrationKnowsHowWarmARunBegan) {
  const auto fitted = [&](std::vector<emtb::Run> runs) {
    return calibrate(prepare(runs, {}, bench.model).train, bench.model);
  };
  const std::vector<emtb::Run> runs{part(0, 20), part(60, 80)};
  const Calibration known = fitted(runs);
  EXPECT_NEAR(known.model.effects.at(0).parameters.at(0).value, drop, 0.1 * drop);
  EXPECT_NEAR(known.model.effects.at(0).parameters.at(1).value, tau, 0.15 * tau);
  std::vector<emtb::Run> cold = runs;
  cold[1].field_on = 0;
  EXPECT_GT(fitted(cold).cost, 1.5 * known.cost) << "as if the field had been off between them";
}

TEST_F(FieldOn, TheLiveEstimatorKnowsToo) {
  Model& model = bench.model;
  model.effects.at(0).parameters.at(0).value = drop;
  model.effects.at(0).parameters.at(1).value = tau;
  for (Parameter& p : model.effects.at(0).parameters) p.fixed = true;
  const auto errors_of_k_b = [&](double field_on) {
    emtb::Run run = part(60, 120);
    run.field_on = field_on;
    LiveEstimator estimator(model, bench.channels(), bench.setup.rate);
    feed(estimator, run);
    return std::abs(in_errors(estimator.estimates(), "K_b", bench.truth.at("K_b")));
  };
  EXPECT_LT(errors_of_k_b(60), 3);
  EXPECT_GT(errors_of_k_b(0), 5);
}

}  // namespace
}  // namespace emtb
