#include "analysis/diagnose/plausibility.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include "analysis/diagnose/moves.h"
#include "analysis/diagnose/null_fit.h"
#include "analysis/diagnose/refit.h"
#include "analysis/fit/rotor_phase.h"
#include "analysis/record/settled_pieces.h"
#include "model/catalogue.h"
#include "model/plausible.h"

namespace emtb {
namespace {

/// Do all of them point nearly the same way, as an absolute encoder reads it?
bool at_the_same_place(std::span<const RotorPhase> phases) {
  constexpr double near = 0.5;  // [rad] by chance in one of six runs
  std::vector<std::complex<double>> places;
  std::complex<double> sum;
  for (const RotorPhase& phase : phases) {
    if (phase.at.empty()) continue;
    places.push_back(std::polar(1.0, phase.at.front()));
    sum += places.back();
  }
  return places.size() > 1 && std::ranges::all_of(places, [&](const std::complex<double>& place) {
           return std::abs(std::arg(place / sum)) < near;
         });
}

/// Of what there is without all that repeats with the angle: the share of squares that is left with it.
double share_left(std::span<const Record> records, const Model& fitted, std::span<const Residuals> left) {
  constexpr int few = 8;  // steps
  const Model rest = without(fitted, [](const EffectInfo& about) { return about.periodic; });
  const double cost = first_steps(records, rest, few, {}).cost;
  return cost > 0 && cost < infinity ? 0.5 * sum_of_squares(left) / cost : 1;
}

constexpr double straight = 0.35;  // [rad] by chance in one of nine runs

/// At rest, but for what noise makes of it, and not driven.
bool begins_idle(const Record& record) {
  const Excitation& x = record.excitation;
  const std::vector<double>& input = input_of(x);
  const double drifts = std::abs(x.initial.omega) * (x.t.back() - x.t.front());
  return drifts < straight && !input.empty() && input.front() == 0;
}

/// Is all that repeats with the angle a weight that hangs straight down wherever a run begins at rest while nothing
/// drives?
bool hangs_at_first(std::span<const Record> records, const Model& fitted, const RotorPhases& phases) {
  const IncludedEffect* weight = nullptr;
  for (const IncludedEffect& e : fitted.effects) {
    const EffectInfo& about = fitted.about(e.effect);
    if (!about.periodic) continue;
    if (weight != nullptr || about.stage != Stage::load || about.place_of(Role::order)) return false;
    weight = &e;
  }
  if (weight == nullptr) return false;
  const double phase = weight->parameters[*fitted.about(weight->effect).place_of(Role::phase)].value;
  bool any = false;
  for (std::size_t i = 0; i < records.size(); ++i) {
    if (!begins_idle(records[i]) || phases[i].at.empty()) continue;
    if (std::cos(phases[i].at.front() + phase) < std::cos(straight)) return false;
    any = true;
  }
  return any;
}

/// Is what repeats with the angle told by parts of a turn, too? A force that drifts can be followed by the phase that
/// is free in each run, but not where the shaft turns by a good part of a turn: there one size has to explain nearly
/// all that there is of several runs, or most of what swings a weight that hung straight down.
bool told_by_parts_of_a_turn(std::span<const Record> records, const Model& fitted) {
  constexpr double good_part = 0.25;  // turns
  constexpr std::size_t several = 3;
  constexpr double nearly_nothing = 0.05, little = 0.3;  // of the squares
  const auto repeats = [&](std::size_t effect) { return fitted.about(effect).periodic; };
  if (std::ranges::none_of(fitted.structure().effects, repeats)) return false;
  const ResidualsAtPhases at = residuals_at_best_phases(records, fitted, fitted.values(), {});
  if (at_the_same_place(at.phases)) return true;
  if (most_turns(records) < good_part) return false;
  const bool hangs = hangs_at_first(records, fitted, at.phases);
  if (!hangs && records.size() < several) return false;
  return share_left(records, fitted, at.residuals) < (hangs ? little : nearly_nothing);
}

/// What rests on a bound at which it is not absent. (A limit of the driver may be so far off that it is none.)
std::string at_its_bound(const EffectInfo& about, const std::vector<Parameter>& parameters,
                         std::span<const double> values) {
  constexpr double near = 1e-3;  // of the way
  for (std::size_t i = 0; i < about.parameter_count; ++i) {
    const EffectParameter& p = about.parameter_list[i];
    if (p.role != Role::amplitude || parameters[i].fixed) continue;
    if (p.null == infinity && values[i] <= (1 + near) * parameters[i].min) {
      return Plausible(about, values).at_least(i, values[i], "a bound beyond which it would go");
    }
    const double room = near * (parameters[i].max - parameters[i].min);
    if (p.null != infinity && values[i] >= parameters[i].max - room && p.null < parameters[i].max - room) {
      return Plausible(about, values).at_most(i, std::abs(values[i]), "a bound beyond which it would go");
    }
    if (p.null != infinity && values[i] <= parameters[i].min + room && p.null > parameters[i].min + room) {
      return Plausible(about, values).at_most(i, std::abs(values[i]), "a bound beyond which it would go");
    }
  }
  return {};
}

/// Is it within its range for all that is known of its values? The range ends at a round number, and so does no
/// machine.
bool may_be_plausible(std::size_t effect, const std::vector<Parameter>& parameters, const std::vector<double>& values,
                      const FittedMachine& machine) {
  constexpr double within = 2;   // standard errors
  constexpr double round = 0.1;  // of itself: how well the end of a range is known
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    if (!parameters[i].std_error) continue;
    const double by = std::max(within * *parameters[i].std_error, round * std::abs(values[i]));
    for (const double side : {-by, by}) {
      std::vector<double> other = values;
      other[i] = std::clamp(values[i] + side, parameters[i].min, parameters[i].max);
      if (implausible(effect, other, machine).empty()) return true;
    }
  }
  return false;
}

}  // namespace

double most_turns(std::span<const Record> records) {
  double most = 0;
  for (const Record& record : records) {
    if (record.excitation.angle.empty()) continue;
    const auto [low, high] = std::ranges::minmax(record.excitation.angle);
    most = std::max(most, (high - low) / (2 * std::numbers::pi));
  }
  return most;
}

double finest_wave(std::span<const Record> records) {
  constexpr double turns = 0.01;     // of the most from row to row: less is rest
  constexpr std::size_t share = 10;  // of the rows, as one in so many
  double finest = 0;
  for (const Record& record : records) {
    const auto& angle = record.excitation.angle;
    std::vector<double> steps;
    for (std::size_t k = 1; k < angle.size(); ++k) steps.push_back(std::abs(angle[k] - angle[k - 1]));
    if (steps.empty()) return infinity;  // nothing tells it
    const double least = turns * std::ranges::max(steps);
    std::erase_if(steps, [&](double step) { return step <= least; });
    if (steps.empty()) continue;
    const auto slow = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / share);
    std::ranges::nth_element(steps, slow);
    finest = std::max(finest, std::numbers::pi / *slow);
  }
  return finest;
}

FittedMachine machine_of(std::span<const Record> records, const Model& fitted) {
  FittedMachine machine = motor_of(fitted);
  machine.seen = ranges_of(records, without_sensors(fitted));
  machine.turns = most_turns(records);
  machine.parts_of_a_turn_tell = machine.turns >= 1 || told_by_parts_of_a_turn(records, fitted);
  return machine;
}

std::string implausible_value(std::span<const Record> records, const Model& fitted, std::size_t effect) {
  const std::vector<Parameter>& parameters = fitted.parameters_of(effect);
  const std::vector<double> values = values_of(parameters);
  if (const std::optional<std::size_t> order = fitted.about(effect).place_of(Role::order)) {
    std::string said = Plausible(fitted.about(effect), values)
                           .at_most(*order, finest_wave(records), "the finest wave that these rows follow");
    if (!said.empty()) return said;
  }
  if (effect < effect_count) {
    const FittedMachine machine = machine_of(records, fitted);
    std::string said = implausible(effect, values, machine);
    if (!said.empty() && !may_be_plausible(effect, parameters, values, machine)) return said;
  }
  return at_its_bound(fitted.about(effect), parameters, values);
}

}  // namespace emtb
