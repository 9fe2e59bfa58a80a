#pragma once

#include <algorithm>
#include <cmath>

#include "model/catalogue.h"
#include "model/simulation.h"
#include "model/step.h"

namespace emtb {

/// The definition of simulate(), for any scalar; included only where it is instantiated.
template <class Scalar>
void simulate(const ModelStructure& structure, std::span<const Scalar> parameters, const Excitation& x,
              Reader<Scalar>& reader, const Variation& variation) {
  const std::size_t n = x.t.size();
  if (n == 0) return;
  Machine<Scalar> machine(structure, parameters);
  const bool quick = std::ranges::any_of(structure.effects, [](std::size_t e) { return effect_catalogue()[e].quick; });
  const std::span<const double> angle = variation.angle.empty() ? std::span<const double>(x.angle) : variation.angle;
  const auto read = [&](std::size_t k) { reader.read(k, machine.readings()); };
  const auto at = [](const std::vector<double>& values, std::size_t k) { return values.empty() ? 0.0 : values[k]; };
  StepInput in{.u_ref = at(x.u_ref, 0),
               .e_a_mean = at(x.e_a, 0),
               .e_a_end = at(x.e_a, 0),
               .i_a = at(x.i_a, 0),
               .load = at(x.load, 0),
               .omega = at(x.omega, 0),
               .omega_end = at(x.omega, 0),
               .angle_middle = {},
               .angle_end = {},
               .angle_pull = {},
               .angle_integrated = x.angle_integrated};
  if (!angle.empty()) in.angle_end = angle[0];
  machine.start(x.initial, in);
  read(0);
  // A clock that ticks evenly but for the rounding of its times ticks evenly: what depends on h alone is computed once.
  const double even = (x.t.back() - x.t.front()) / static_cast<double>(std::max<std::size_t>(1, n - 1));
  double longest_step = quick ? std::min(x.quick_step, x.longest_step) : x.longest_step;
  if (variation.half_steps) longest_step = 0.5 * std::min(even, longest_step);
  for (std::size_t k = 0; k + 1 < n; ++k) {
    double interval = x.t[k + 1] - x.t[k];
    if (std::abs(interval - even) < 1e-9 * even) interval = even;
    in.u_ref = at(x.u_ref, k);
    in.i_a = at(x.i_a, k);
    if (!x.temperature.empty()) in.temperature = x.temperature[k];
    if (!x.angle_pull.empty()) in.angle_pull = x.angle_pull[k];
    in.armature_open = !x.armature_open.empty() && x.armature_open[k] != 0;
    const bool whole = interval <= longest_step * (1 + 1e-6);
    const int steps = whole ? 1 : static_cast<int>(std::ceil(interval / longest_step - 1e-6));
    const double h = interval / steps;
    for (int s = 0; s < steps; ++s) {
      const auto part = [&](std::span<const double> values, double where) {
        return values.empty() ? 0.0 : values[k] + (values[k + 1] - values[k]) * where;
      };
      in.e_a_mean = part(x.e_a, (s + 0.5) / steps) + at(x.e_a_bulge, k);
      in.e_a_end = part(x.e_a, static_cast<double>(s + 1) / steps);
      in.load = part(x.load, (s + 0.5) / steps);
      in.omega = part(x.omega, (s + 0.5) / steps);
      in.omega_end = part(x.omega, static_cast<double>(s + 1) / steps);
      if (!angle.empty()) {
        in.angle_middle = part(angle, (s + 0.5) / steps);
        in.angle_end = part(angle, static_cast<double>(s + 1) / steps);
      }
      machine.step(in, x.t[k] + s * h, h);
    }
    read(k + 1);
  }
}

}  // namespace emtb
