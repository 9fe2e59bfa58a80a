#include "analysis/estimate/static_experiments.h"

#include <algorithm>

#include "analysis/estimate/driver_steps.h"
#include "analysis/estimate/electrical.h"
#include "analysis/estimate/inertia.h"
#include "analysis/estimate/stretches.h"
#include "analysis/estimate/torque.h"

namespace emtb {

std::vector<StaticEstimate> evaluate(std::span<const std::string_view> what, std::span<const Run> runs,
                                     const Settled& settled, KnownParameters known) {
  const StaticEstimate armature = estimate_armature(settled), generator = estimate_generator(runs, settled);
  if (!known.K_m || known.K_m_is_guess) {
    for (const auto& [from, words] : {std::pair{&armature, "K_b of these settled points, which is K_m in SI units"},
                                      std::pair{&generator, "K_b of the generator test, which is K_m in SI units"}}) {
      if (!from->has("K_b")) continue;
      known.K_m = from->at("K_b");
      known.K_m_from = words;
      break;
    }
  }
  const StaticEstimate friction = estimate_friction(settled, known);
  if (!known.T_c && friction.has("T_c")) {
    known.T_c = friction.at("T_c");
    known.B = friction.at("B");
    known.T_c_from = "the friction of these settled points";
  }
  std::vector<StaticEstimate> all;
  for (const std::string_view name : what) {
    if (name == "resistance") {
      all.push_back(estimate_equation_6(settled));
      all.push_back(armature);
    } else if (name == "generator") {
      all.push_back(generator);
    } else if (name == "friction") {
      all.push_back(estimate_load_line(settled));
      all.push_back(friction);
    } else if (name == "torque-constant") {
      all.push_back(estimate_torque_constant(settled));
    } else if (name == "inertia") {
      all.push_back(estimate_switch_on(runs, known));
      all.push_back(estimate_acceleration(runs, known));
    } else if (name == "coast-down") {
      all.push_back(estimate_coast_down(runs, known));
    } else if (name == "driver") {
      all.push_back(estimate_driver_gain(settled));
      all.push_back(estimate_driver_slopes(runs));
    }
  }
  return all;
}

std::vector<Run> with_speed(std::vector<Run> runs) {
  constexpr double half = 0.02;  // [s]
  for (Run& run : runs) {
    if (run.has(Signal::omega) || !run.has(Signal::theta) || run.at(Signal::theta).t.size() < 2) continue;
    const Series& theta = run.at(Signal::theta);
    Series speed;
    speed.source = "slope of theta";
    for (const double t : theta.t) {
      const LocalLine line = local_line(theta, t - half, t + half);
      if (line.readings < 4) continue;
      speed.t.push_back(t);
      speed.value.push_back(line.slope);
    }
    run.signals[Signal::omega] = std::move(speed);
  }
  return runs;
}

}  // namespace emtb
