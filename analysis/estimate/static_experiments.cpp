#include "analysis/estimate/static_experiments.h"

#include <utility>

#include "analysis/estimate/acceleration.h"
#include "analysis/estimate/coast_down.h"
#include "analysis/estimate/driver_steps.h"
#include "analysis/estimate/electrical.h"
#include "analysis/estimate/switch_on.h"
#include "analysis/estimate/torque.h"

namespace emtb {
namespace {

void take_K_m(KnownParameters& known, const StaticEstimate& armature, const StaticEstimate& generator) {
  if (known.K_m && !known.K_m_is_guess) return;
  for (const auto& [from, words] : {std::pair{&armature, "K_b of these settled points, which is K_m in SI units"},
                                    std::pair{&generator, "K_b of the generator test, which is K_m in SI units"}}) {
    if (!from->has("K_b")) continue;
    known.K_m = from->at("K_b");
    known.K_m_from = words;
    return;
  }
}

void take_friction(KnownParameters& known, const StaticEstimate& friction) {
  if (known.T_c || !friction.has("T_c")) return;
  known.T_c = friction.at("T_c");
  known.B = friction.at("B");
  known.T_c_from = "the friction of these settled points";
}

}  // namespace

std::vector<StaticEstimate> evaluate(std::span<const StaticExperiment> experiments, std::span<const Run> runs,
                                     const Settled& settled, KnownParameters known) {
  const StaticEstimate armature = estimate_armature(settled), generator = estimate_generator(runs, settled);
  take_K_m(known, armature, generator);
  const StaticEstimate friction = estimate_friction(settled, known);
  take_friction(known, friction);
  std::vector<StaticEstimate> all;
  for (const StaticExperiment experiment : experiments) {
    switch (experiment) {
      case StaticExperiment::resistance:
        all.push_back(estimate_equation_6(settled));
        all.push_back(armature);
        break;
      case StaticExperiment::generator:
        all.push_back(generator);
        break;
      case StaticExperiment::friction:
        all.push_back(estimate_load_line(settled));
        all.push_back(friction);
        break;
      case StaticExperiment::torque_constant:
        all.push_back(estimate_torque_constant(settled));
        break;
      case StaticExperiment::inertia:
        all.push_back(estimate_switch_on(runs, known));
        all.push_back(estimate_acceleration(runs, known));
        break;
      case StaticExperiment::coast_down:
        all.push_back(estimate_coast_down(runs, known));
        break;
      case StaticExperiment::driver:
        all.push_back(estimate_driver_gain(settled));
        all.push_back(estimate_driver_slopes(runs));
        break;
      case StaticExperiment::inverse_dynamics:
        break;
    }
  }
  return all;
}

std::vector<Run> with_speed(std::vector<Run> runs) {
  constexpr double half =
      0.02;  // [s] as inverse dynamics take: long against the steps of an encoder, short for a shaft
  constexpr std::size_t fewest = 4;  // readings of a line: by hand, twice what it fits
  for (Run& run : runs) {
    if (run.has(Signal::omega) || !run.has(Signal::theta) || run.at(Signal::theta).t.size() < 2) continue;
    const Series& theta = run.at(Signal::theta);
    Series speed;
    speed.source = "slope of theta";
    for (const double t : theta.t) {
      const LocalLine line = local_line(theta, t - half, t + half);
      if (line.readings < fewest) continue;
      speed.t.push_back(t);
      speed.value.push_back(line.slope);
    }
    run.signals[Signal::omega] = std::move(speed);
  }
  return runs;
}

}  // namespace emtb
