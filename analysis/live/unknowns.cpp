#include "analysis/live/unknowns.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <string>
#include <utility>

#include "model/catalogue.h"
#include "model/simulation.h"

namespace emtb {
namespace {

// Nothing is known better than a simulation can be trusted. By hand, on the two simulated benches: what let healthy
// motors stay quiet (docs/decisions/live-estimates.md).
constexpr double drift_share = 3e-3;    ///< of a parameter's value, that is no change
constexpr double flux_drift = 1e-3;     ///< the same of K_b and K_m
constexpr double drift_of_null = 0.02;  ///< the same of what the model lacks, of its believed size
constexpr double digit_share = 0.3;     ///< of an instrument's resolution by which its mean may be off
constexpr double believed = 0.02;       ///< of what the motor does, as the size of what the model lacks

constexpr std::size_t lanes = 2 * derivatives_per_pass;

/// What goes nowhere but into one reading: the errors of instruments, and a load that is measured.
std::optional<Signal> shown_by(std::size_t effect, bool measured_load) {
  const EffectInfo& about = effect_catalogue()[effect];
  return about.stage == Stage::load && measured_load ? Signal::torque : about.reads;
}

/// The model with as many of the effects that it lacks as cost no simulation more.
Model with_watched_effects(const Model& model, const LivePlan& plan) {
  Model whole = model;
  std::size_t moving = plan.moved.size();
  for (const Parameter& p : model.base) moving += p.fixed && !model.tie.contains(p.symbol) ? 1 : 0;
  std::size_t room = (std::max<std::size_t>(moving, 1) + lanes - 1) / lanes * lanes - moving;
  for (const std::size_t effect : watched_effects()) {
    if (room == 0 || whole.includes(effect) || shown_by(effect, plan.structure.measured_load)) continue;
    whole.include(effect);
    --room;
  }
  return whole;
}

/// Puts the unknowns together: what the model moves and what it fixes first, then what it lacks.
class Collection {
 public:
  Collection(const Model& model, const LivePlan& given)
      : plan(given),
        whole_(with_watched_effects(model, given)),
        free_(whole_),
        names_(whole_.names()),
        model_names_(model.names()) {
    plan.structure = whole_.structure();
    plan.structure.measured_voltage = given.structure.measured_voltage;
    plan.structure.measured_load = given.structure.measured_load;
    point = whole_.values();
    for (const std::size_t effect : watched_effects())
      amplitudes_.emplace(full_name(effect_catalogue()[effect]), effect);
    plan.moved.clear();
    add_free(true);
    add_fixed();
    add_free(false);
    add_direct();
    plan.offsets = 0;
    for (auto& output : plan.outputs) {
      if (output.slow) output.offset = plan.moved.size() + plan.direct.size() + plan.offsets++;
    }
  }

  LivePlan plan;
  std::vector<WatchedParameter> parameters;
  std::vector<double> point;

 private:
  std::optional<std::size_t> in_model(const std::string& name) const {
    const auto at = std::ranges::find(model_names_, name);
    if (at == model_names_.end()) return {};
    return static_cast<std::size_t>(at - model_names_.begin());
  }

  void add(std::size_t place, std::vector<std::size_t> moved) {
    const Parameter& p = whole_.at(place);
    WatchedParameter watched{.name = names_[place],
                             .unit = p.unit,
                             .low = p.min,
                             .high = p.max,
                             .at = in_model(names_[place]),
                             .prior = p.prior};
    if (p.fixed) watched.fixed_to = drift_share * std::abs(p.value);
    if (!watched.in_model()) {
      watched.effect = amplitudes_.at(watched.name);
      watched.may_change = effect_catalogue()[watched.effect].watch->varies;
    }
    parameters.push_back(std::move(watched));
    plan.moved.push_back(std::move(moved));
  }

  void add_free(bool of_model) {
    const auto moves = moved_by(free_);
    for (std::size_t k = 0; k < free_.size(); ++k) {
      const std::size_t place = free_.places()[k];
      if (in_model(names_[place]).has_value() != of_model) continue;
      if (!of_model && !amplitudes_.contains(names_[place])) continue;
      add(place, moves[k]);
    }
  }

  /// The base parameters that the model file fixes, with their followers.
  void add_fixed() {
    for (std::size_t place = 0; place < ModelStructure::base_count; ++place) {
      if (!whole_.base[place].fixed || whole_.tie.contains(whole_.base[place].symbol)) continue;
      std::vector<std::size_t> moved{place};
      for (const auto& [follower, leader] : whole_.tie) {
        if (leader != names_[place]) continue;
        moved.push_back(static_cast<std::size_t>(std::ranges::find(names_, follower) - names_.begin()));
      }
      add(place, std::move(moved));
    }
  }

  void add_direct() {
    for (const std::size_t effect : watched_effects()) {
      const std::optional<Signal> signal = shown_by(effect, plan.structure.measured_load);
      if (!signal || whole_.includes(effect)) continue;
      if (std::ranges::find(plan.outputs, *signal, &LivePlan::Output::signal) == plan.outputs.end()) continue;
      const EffectInfo& about = effect_catalogue()[effect];
      const EffectParameter& p = about.parameter_list[0];
      parameters.push_back({.name = full_name(about),
                            .unit = std::string(p.unit),
                            .low = p.min,
                            .high = p.max,
                            .at = {},
                            .effect = effect,
                            .prior = {}});
      plan.direct.push_back(*signal);
    }
  }

  const Model whole_;
  const FreeParameters free_;
  const std::vector<std::string> names_, model_names_;
  std::map<std::string, std::size_t> amplitudes_;  ///< of the watched effects
};

}  // namespace

void LiveReach::see(double some_omega, double some_i_a) {
  omega = std::max(omega, std::abs(some_omega));
  i_a = std::max(i_a, std::abs(some_i_a));
}

WatchedUnknowns::WatchedUnknowns(const Model& model, const LivePlan& plan) {
  Collection all(model, plan);
  plan_ = std::move(all.plan);
  parameters_ = std::move(all.parameters);
  point_ = std::move(all.point);
  digits_ = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(plan_.unknowns()));
  for (const auto& output : plan_.outputs) {
    if (output.slow) digits_[static_cast<Eigen::Index>(output.offset)] = std::max(output.lsb, 1e-9);
    if (output.signal == Signal::torque) gauge_digit_ = output.lsb;
  }
  for (Eigen::Index i = 0; i < size(); ++i) {
    if (digits_[i] > 0 || parameters_[static_cast<std::size_t>(i)].in_model()) of_model_.push_back(i);
  }
  const auto dry_friction = std::ranges::find(effect_catalogue(), true, &EffectInfo::dry_friction);
  for (std::size_t j = 0; j < parameters_.size(); ++j) {
    if (parameters_[j].at == base::J) inertia_ = j;
    if (parameters_[j].name == full_name(*dry_friction)) drag_ = j;
    if (!moves(j) && plan_.direct[j - plan_.moved.size()] == Signal::torque) gauge_ = j;
  }
}

std::optional<std::size_t> WatchedUnknowns::output_of_reading(std::size_t j) const {
  if (moves(j) || j - plan_.moved.size() >= plan_.direct.size()) return std::nullopt;
  const auto output = std::ranges::find(plan_.outputs, plan_.direct[j - plan_.moved.size()], &LivePlan::Output::signal);
  if (output == plan_.outputs.end()) return std::nullopt;
  return static_cast<std::size_t>(output - plan_.outputs.begin());
}

Eigen::VectorXd WatchedUnknowns::move_point(Eigen::VectorXd d) {
  for (std::size_t j = 0; j < static_cast<std::size_t>(d.size()); ++j) {
    const auto i = static_cast<Eigen::Index>(j);
    if (!moves(j) || !parameters_[j].in_model()) {
      d[i] = 0;
      continue;
    }
    const double from = value(j);
    const double to = std::clamp(from + d[i], parameters_[j].low, parameters_[j].high);
    d[i] = to - from;
    for (const std::size_t place : plan_.moved[j]) point_[place] = to;
  }
  return d;
}

LiveEquations WatchedUnknowns::prior() const {
  LiveEquations prior = LiveEquations::zero(size());
  for (Eigen::Index i = 0; i < size(); ++i) {
    double& information = prior.h(i, i);
    if (digits_[i] > 0) {
      information = 12 / (digits_[i] * digits_[i]);
      continue;
    }
    const WatchedParameter& p = parameters_[static_cast<std::size_t>(i)];
    const double range = p.high - p.low;
    information = 12 / (range * range);
    if (p.fixed_to > 0) information = 1 / (p.fixed_to * p.fixed_to);
    if (p.prior) {
      information = 1 / (p.prior->std * p.prior->std);
      prior.g[i] = information * (p.prior->value - value(static_cast<std::size_t>(i)));
    }
  }
  return prior;
}

double WatchedUnknowns::believed_size(std::size_t j, const LiveReach& reach) const {
  const double flux = point_[base::K_b];
  const Ranges seen{
      .voltage = reach.omega * flux, .current = reach.i_a, .torque = reach.i_a * flux, .speed = reach.omega};
  return size_at(parameters_[j].effect, believed, seen);
}

double WatchedUnknowns::allowed_drift(std::size_t j, const LiveReach& reach) const {
  const WatchedParameter& p = parameters_[j];
  if (p.in_model()) {
    const bool flux = p.at == base::K_b || p.at == base::K_m;
    return (flux ? flux_drift : drift_share) * std::abs(value(j));
  }
  double digit = 0;
  if (!moves(j)) {
    const Signal signal = plan_.direct[j - plan_.moved.size()];
    digit = std::ranges::find(plan_.outputs, signal, &LivePlan::Output::signal)->lsb;
  }
  return std::max(digit_share * digit, drift_of_null * believed_size(j, reach));
}

}  // namespace emtb
