#pragma once

#include <algorithm>
#include <cmath>

#include "model/catalogue.h"
#include "model/simulation.h"
#include "model/step.h"

namespace emtb {

/// The definition of simulate(), compiled for the processor that this source is compiled for; included only where it is
/// instantiated.
/// @param reader a Reader, or what is called alike
template <class Scalar, class To>
void simulate_here(const ModelStructure& structure, std::span<const Scalar> parameters, const Excitation& x, To& reader,
                   const Variation& variation) {
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
  in.armature_open = !x.armature_open.empty() && x.armature_open[0] != 0;
  machine.start(x.initial, in);
  read(0);
  // A clock that ticks evenly but for the rounding of its times ticks evenly: what depends on h alone is computed once.
  const double even = (x.t.back() - x.t.front()) / static_cast<double>(std::max<std::size_t>(1, n - 1));
  double longest_step = quick ? std::min(x.quick_step, x.longest_step) : x.longest_step;
  if (variation.half_steps) longest_step = 0.5 * std::min(even, longest_step);
  // Over a part of the interval from k on, under the held inputs of a row.
  const auto advance = [&](std::size_t k, std::size_t row, double from, double until, double interval) {
    in.u_ref = at(x.u_ref, row);
    in.i_a = at(x.i_a, row);
    const double length = (until - from) * interval;
    const bool whole = length <= longest_step * (1 + 1e-6);
    const int steps = whole ? 1 : static_cast<int>(std::ceil(length / longest_step - 1e-6));
    const double h = length / steps;
    for (int s = 0; s < steps; ++s) {
      const double begin = from + (until - from) * s / steps, end = from + (until - from) * (s + 1) / steps;
      const auto part = [&](std::span<const double> values, double where) {
        return values.empty() ? 0.0 : values[k] + (values[k + 1] - values[k]) * where;
      };
      in.e_a_mean = x.e_a_held ? at(x.e_a, row) : part(x.e_a, 0.5 * (begin + end)) + at(x.e_a_bulge, k);
      in.e_a_end = x.e_a_held ? at(x.e_a, row) : part(x.e_a, end);
      in.load = part(x.load, 0.5 * (begin + end));
      in.omega = part(x.omega, 0.5 * (begin + end));
      in.omega_end = part(x.omega, end);
      if (!angle.empty()) {
        in.angle_middle = part(angle, 0.5 * (begin + end));
        in.angle_end = part(angle, end);
      }
      machine.step(in, x.t[k] + begin * interval, h);
    }
  };
  const auto changes = [&](std::size_t row, std::size_t other) {
    return at(x.u_ref, row) != at(x.u_ref, other) || at(x.i_a, row) != at(x.i_a, other) ||
           (x.e_a_held && at(x.e_a, row) != at(x.e_a, other));
  };
  for (std::size_t k = 0; k + 1 < n; ++k) {
    double interval = x.t[k + 1] - x.t[k];
    if (std::abs(interval - even) < 1e-9 * even) interval = even;
    if (!x.temperature.empty()) in.temperature = x.temperature[k];
    if (!x.angle_pull.empty()) in.angle_pull = x.angle_pull[k];
    in.armature_open = !x.armature_open.empty() && x.armature_open[k] != 0;
    if (x.acts_after < 0 && changes(k, k + 1)) {
      const double acts = std::max(0.0, 1 + x.acts_after / interval);
      if (acts > 0) advance(k, k, 0, acts, interval);
      advance(k, k + 1, acts, 1, interval);
    } else if (x.acts_after > 0 && k > 0 && changes(k - 1, k)) {
      const double acts = std::min(1.0, x.acts_after / interval);
      advance(k, k - 1, 0, acts, interval);
      if (acts < 1) advance(k, k, acts, 1, interval);
    } else {
      advance(k, k, 0, 1, interval);
    }
    read(k + 1);
  }
}

/// For a scalar that model/simulation_code.h does not name.
template <class Scalar>
void simulate(const ModelStructure& structure, std::span<const Scalar> parameters, const Excitation& x,
              Reader<Scalar>& reader, const Variation& variation) {
  simulate_here(structure, parameters, x, reader, variation);
}

}  // namespace emtb
