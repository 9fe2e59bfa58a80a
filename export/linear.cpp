#include "export/linear.h"

#include <algorithm>
#include <cmath>

#include "hal/error.h"
#include "model/catalogue.h"
#include "model/machine/reaction.h"

namespace emtb {
namespace {

double sign(double x) { return x > 0 ? 1.0 : x < 0 ? -1.0 : 0.0; }

/// The terms of a model's equations at a state that lasts.
Balance<double> terms_at(const Model& model, double omega, double i_a, double u) {
  const std::vector<double> p = model.values();
  const DriverModel driver = model.driver.value_or(DriverModel{});
  Balance<double> b{};
  b.u = u;
  b.gain = driver.gain;
  b.min = driver.min;
  b.max = driver.max;
  b.flux = 1;
  b.resistance = p[base::R_a];
  b.inertia = p[base::J];
  b.viscous = p[base::B];
  State<double> x{};
  x.omega = x.omega_start = omega;
  x.i_a = i_a;
  x.u_ref = u;
  std::size_t place = ModelStructure::base_count;
  for (const IncludedEffect& e : model.effects) {
    const EffectInfo& info = effect_catalogue()[e.effect];
    const bool machine = info.stage != Stage::sensors && info.memory == 0;
    if (machine) apply_of<double>(e.effect)({p.data() + place, info.parameter_count}, {}, x, b);
    place += info.parameter_count;
  }
  if (b.reaction != 0) b.flux *= flux_left(b, i_a);
  return b;
}

/// [N m] that friction and load of the model take.
double taken(const Model& model, double omega, double i_a) {
  const Balance<double> b = terms_at(model, omega, i_a, 0);
  const double geared = b.gear_friction * std::abs(model.values()[base::K_m] * b.flux * i_a + b.load_torque);
  return b.viscous * omega + b.braking_torque + b.load_torque + sign(omega) * (b.dry_friction + b.brake + geared);
}

/// [N m] at the shaft, what is taken but for an outer load left out.
double given(const Model& model, double omega, double i_a) {
  return model.values()[base::K_m] * terms_at(model, omega, i_a, 0).flux * i_a - taken(model, omega, i_a);
}

/// [V] of the driver that the armature needs while the current stands.
double needed(const Model& model, double omega, double i_a) {
  const Balance<double> b = terms_at(model, omega, i_a, 0);
  double v = (b.resistance + b.output_resistance) * i_a + model.values()[base::K_b] * b.flux * omega;
  if (b.contact_drop != 0) v += b.contact_drop * std::tanh(i_a / b.contact_knee);
  if (b.light_load_rise != 0) v -= b.light_load_rise * std::exp(-std::abs(i_a) / b.light_load_current);
  return v;
}

/// What the driver is asked for, before its limits.
double target(const Model& model, double u) {
  const Balance<double> b = terms_at(model, 0, 0, u);
  return b.gain * b.u + b.offset;
}

/// A central difference.
template <class F>
double slope(F f, double at, double step) {
  return (f(at + step) - f(at - step)) / (2 * step);
}

/// The current that holds a speed against a torque. Newton's steps: the torque is nearly straight in the current.
double current_for(const Model& model, double omega, double load) {
  const double K_m = model.values()[base::K_m];
  double i = 0;
  for (int n = 0; n < 50; ++n) {
    const double step = 1e-6 * std::max(1e-3, std::abs(i));
    const auto f = [&](double current) { return given(model, omega, current) - load; };
    const double by = slope(f, i, step);
    const double change = f(i) / (std::abs(by) > 1e-6 * std::abs(K_m) ? by : K_m);
    i -= change;
    if (std::abs(change) < 1e-12 * std::max(1.0, std::abs(i))) break;
  }
  return i;
}

void refuse_memory(const Model& model) {
  std::string names;
  for (const IncludedEffect& e : model.effects) {
    const EffectInfo& info = effect_catalogue()[e.effect];
    if (info.stage != Stage::sensors && info.memory > 0) names += (names.empty() ? "" : ", ") + std::string(info.id);
  }
  for (const AddedTerm& term : model.terms) names += (names.empty() ? "" : ", ") + term.name + " (a formula)";
  if (names.empty()) return;
  throw ModelError("model `" + model.name + "`: " + names +
                   " cannot be linearised: it has states or a law of its own. Take it out of the model");
}

}  // namespace

LinearMachine linearise(const Model& model, const WorkingPoint& at) {
  refuse_memory(model);
  const double w = at.omega, dw = 1e-4 * std::max(1.0, std::abs(w));
  const Balance<double> rest = terms_at(model, w, 0, 0);
  if (std::abs(w) < 1e-6 && rest.dry_friction + rest.brake > 0) {
    throw ModelError("model `" + model.name + "` has dry friction, which holds the shaft at rest: no small change " +
                     "moves it. Give a speed: --at RAD_S");
  }
  LinearMachine m;
  m.i_a = current_for(model, w, at.load);
  m.e_a = needed(model, w, m.i_a);
  const double i = m.i_a, di = 1e-4 * std::max(1e-3, std::abs(i));
  m.R = slope([&](double x) { return needed(model, w, x); }, i, di);
  m.K_b = slope([&](double x) { return needed(model, x, i); }, w, dw);
  m.K_m = slope([&](double x) { return given(model, w, x); }, i, di);
  m.B = -slope([&](double x) { return given(model, x, i); }, w, dw);
  m.torque = m.K_m * i - m.B * w - at.load;
  m.voltage = m.e_a - m.R * i - m.K_b * w;
  const Balance<double> b = terms_at(model, w, i, 1);
  m.J = b.inertia;
  m.L = b.inductance;
  m.lag = b.lag;
  m.delay = b.delay;
  if (model.input != Signal::u_ref) return m;
  // The reference at which the driver gives that voltage: beyond a dead zone the target is a straight line.
  double u = m.e_a / b.gain;
  for (int n = 0; n < 20; ++n) {
    const double by = slope([&](double x) { return target(model, x); }, u, 1e-4);
    u -= (target(model, u) - m.e_a) / (by != 0 ? by : b.gain);
  }
  m.gain = slope([&](double x) { return target(model, x); }, u, 1e-4 * std::max(1.0, std::abs(u)));
  return m;
}

std::vector<std::string> not_linear(const Model& model) {
  std::vector<std::string> names;
  for (const IncludedEffect& e : model.effects) {
    const EffectInfo& info = effect_catalogue()[e.effect];
    if (info.stage == Stage::sensors) continue;
    Model alone = model;
    alone.terms.clear();
    std::erase_if(alone.effects, [&](const IncludedEffect& other) { return other.effect != e.effect; });
    const auto differs = [](double a, double b) { return std::abs(a - b) > 1e-6 * (std::abs(a) + std::abs(b)); };
    bool bends = info.memory > 0;
    if (!bends) {
      const Balance<double> b = terms_at(alone, 1, 0.1, 1);
      bends = b.dry_friction != 0 || b.brake != 0 || b.gear_friction != 0 || b.bristle != 0 || b.gap != 0 ||
              b.one_quadrant || b.lets_go || b.chop_period != 0 || info.periodic;
    }
    if (!bends) {
      const LinearMachine slow = linearise(alone, {3, 0}), fast = linearise(alone, {-77, 0.1});
      bends = differs(slow.R, fast.R) || differs(slow.K_b, fast.K_b) || differs(slow.K_m, fast.K_m) ||
              differs(slow.B, fast.B) || differs(slow.gain, fast.gain);
    }
    if (bends) names.emplace_back(info.id);
  }
  for (const AddedTerm& term : model.terms) names.push_back(term.name);
  return names;
}

double braking_torque_at(const Model& model, double omega) { return taken(model, omega, current_for(model, omega, 0)); }

double top_speed(const Model& model) {
  constexpr double where_nothing_limits = 100;
  const Balance<double> b = terms_at(model, 1, 0, 1);
  if (model.input != Signal::u_ref || b.max >= DriverModel::unlimited) return where_nothing_limits;
  const auto reaches = [&](double w) { return needed(model, w, current_for(model, w, 0)) < b.max; };
  double low = 0, high = 1;
  while (reaches(high) && high < 1e6) high *= 2;
  for (int n = 0; n < 60; ++n) (reaches(0.5 * (low + high)) ? low : high) = 0.5 * (low + high);
  return low;
}

ExportedEquations linear_equations(const Model& model, const WorkingPoint& at) {
  const LinearMachine m = linearise(model, at);
  if (m.delay > 0) {
    throw ModelError("model `" + model.name +
                     "`: the driver acts late, which the exported text has no memory for. Export --to state-space");
  }
  Model straight = model;
  straight.effects.clear();
  straight.terms.clear();
  straight.tie.clear();
  for (Parameter& p : straight.base) p.std_error.reset();
  straight.at(base::R_a).value = m.R;
  straight.at(base::K_b).value = m.K_b;
  straight.at(base::K_m).value = m.K_m;
  straight.at(base::B).value = m.B;
  straight.at(base::J).value = m.J;
  ExportedEquations out = equations_of(straight);
  for (ExportedParameter& p : out.parameters) {
    if (p.name == "driver_gain") p.value = m.gain;
  }
  out.parameters.insert(out.parameters.end(), {{"L_a", "H", "armature inductance", m.L},
                                               {"T_0", "N m", "torque of the straight line at standstill", m.torque},
                                               {"e_0", "V", "voltage of the straight line at zero", m.voltage},
                                               {"lag", "s", "of the driver", m.lag}});
  out.machine = {{"inductance", "$L_a"}, {"braking_torque", "$T_0"}, {"bias", "$e_0"}};
  if (model.input == Signal::u_ref) out.driver = {{"lag", "$lag"}};
  char text[120];
  std::snprintf(text, sizeof text, "all effects as straight lines about %g rad/s and a load of %g N m", at.omega,
                at.load);
  out.included = {text};
  return out;
}

}  // namespace emtb
