#include "analysis/diagnose/fitted_trials.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>

#include "analysis/diagnose/moves.h"
#include "analysis/diagnose/plausibility.h"
#include "analysis/diagnose/refit.h"
#include "analysis/diagnose/told_from_nothing.h"
#include "analysis/fit/gauge.h"
#include "analysis/fit/leave_one_out.h"
#include "analysis/numerics/parallel.h"
#include "hal/error.h"
#include "model/catalogue.h"

namespace emtb {
namespace {

/// How far the fits of a search go. No decision is about less than a hundredth of the cost; what creeps on below this
/// is not determined.
CalibrationOptions of_a_search(int extra_starts = 0) {
  return {.extra_starts = extra_starts, .max_iterations = 25, .tolerance = 1e-5, .with_covariance = false};
}

CalibrationOptions to_the_end(int extra_starts = 0) {
  return {.extra_starts = extra_starts, .max_iterations = 40, .tolerance = 1e-8, .with_covariance = false};
}

RotorPhases phases_of(const Trial* known) { return known != nullptr ? known->fit.phases : RotorPhases{}; }

/// The phases that were found of runs: each is a free parameter, of the run that it belongs to.
std::size_t found_in(const RotorPhases& phases) {
  return static_cast<std::size_t>(
      std::ranges::count_if(phases, [](const RotorPhase& phase) { return !phase.at.empty(); }));
}

/// None where it cannot be simulated from there: the search passes it over.
template <class Fit>
std::optional<Trial> attempt(const Fit& fit) {
  try {
    return fit();
  } catch (const ModelError&) {
    return std::nullopt;
  }
}

/// Does a wave keep step with the angle? Where its order is so uncertain that it may be a turn ahead at the end of a
/// run, it is any force that comes and goes.
bool keeps_step(std::span<const Record> records, const Fit& judged, std::size_t effect) {
  const EffectInfo& about = judged.model.about(effect);
  const std::optional<std::size_t> order = about.place_of(Role::order);
  if (!order) return true;
  const std::optional<double> error = judged.model.parameters_of(effect)[*order].std_error;
  return !error || *error * most_turns(records) < 1;
}

}  // namespace

FittedTrials::FittedTrials(const Dataset& data, const Model& given, const Criterion& criterion,
                           const ScoreOptions& score, std::size_t refits)
    : data_(data), given_(given), criterion_(criterion), score_(score), refits_(refits) {}

Trial FittedTrials::first_fit(const Model& start) {
  constexpr int extra_starts = 4;  // only where nothing good is known to start from
  Trial first = fitted(start, of_a_search(extra_starts), nullptr);
  on_bounds_at_first_ = with_standard_errors(data_.train, first.model(), true).at_bound;
  return first;
}

void FittedTrials::bound_by(std::uint64_t steps, std::function<bool()> ends_now) {
  most_steps_ = steps;
  ends_now_ = std::move(ends_now);
}

bool FittedTrials::exhausted() {
  if (ends_now() || (data_.effort && data_.effort->steps() >= most_steps_)) exhausted_ = cut_ = true;
  return exhausted_;
}

void FittedTrials::go_on_by(std::uint64_t steps) {
  if (!exhausted_ || !data_.effort) return;
  most_steps_ = data_.effort->steps() + steps;
  exhausted_ = false;
}

std::optional<Trial> FittedTrials::fit(const Model& start, const Trial* known) {
  return no_worse_than_before(attempt([&] { return fitted(start, of_a_search(), known); }), of_a_search(), known);
}

std::optional<Trial> FittedTrials::fit_to_the_end(const Model& start) {
  return no_worse_than_before(attempt([&] { return fitted(start, to_the_end(), nullptr); }), to_the_end(), nullptr);
}

/// A fit, or that from where an earlier one of the same effects had ended, if this led elsewhere.
std::optional<Trial> FittedTrials::no_worse_than_before(std::optional<Trial> found, const CalibrationOptions& options,
                                                        const Trial* known) {
  if (!found) return found;
  if (const auto start = known_fits_.that_leaves_less(data_.train, found->fit)) {
    std::optional<Trial> other = attempt([&] { return fitted(*start, options, known); });
    if (other && other->fit.cost < found->fit.cost) found = std::move(other);
  }
  known_fits_.remember(found->model());
  return found;
}

std::optional<Trial> FittedTrials::fit_from_elsewhere_too(const Model& start) {
  constexpr int extra_starts = 4;
  std::optional<Trial> found = fit_to_the_end(start);
  if (!found) return found;
  if (const auto nearer = held_nearer(data_.train, given_, found->model())) {
    std::optional<Trial> there = fit_to_the_end(*nearer);
    if (there) found = std::move(there);
  }
  if (auto freed = with_told_pins_free(*found)) found = std::move(freed);
  if (auto other = with_pins_elsewhere(*found)) found = std::move(other);
  if (!criterion_.remainder(found->held_out)) return found;
  const Model anew = with_base_as_given(found->model(), given_);
  std::optional<Trial> other = attempt([&] { return fitted(anew, to_the_end(extra_starts), nullptr); });
  return other && criterion_.material(found->held_out, other->held_out) ? other : found;
}

std::optional<Trial> FittedTrials::with_told_pins_free(const Trial& found) {
  const std::optional<Model> freed = emtb::with_told_pins_free(data_.train, found.model());
  if (!freed) return std::nullopt;
  std::optional<Trial> trial = fit_to_the_end(*freed);
  if (!trial || trial->fit.cost > found.fit.cost) return std::nullopt;
  for (std::size_t i = 0; i < freed->names().size(); ++i) {  // also where the fit has gone since
    const bool was_held = found.model().at(i).pinned && !freed->at(i).pinned;
    if (was_held && !told(data_.train, trial->model(), i)) return std::nullopt;
  }
  return trial;
}

std::optional<Trial> FittedTrials::with_pins_elsewhere(const Trial& found) {
  constexpr double clearly = 0.99;  // of the cost: no decision is about less
  const std::optional<Model> start = emtb::with_pins_elsewhere(data_.train, found.model());
  std::optional<Trial> trial = start ? fit_to_the_end(*start) : std::nullopt;
  return trial && trial->fit.cost < clearly * found.fit.cost ? trial : std::nullopt;
}

Trial FittedTrials::fitted(const Model& start, CalibrationOptions options, const Trial* known) const {
  Trial trial{{}, 0, 0, Loss(data_.noise)};
  options.phases = phases_of(known);
  trial.fit = calibrate(data_.train, start, options);
  const Model& model = trial.fit.model;
  ResidualsAtPhases left = residuals_at_best_phases(data_.train, model, model.values(), {},
                                                    known != nullptr ? trial.fit.phases : RotorPhases{});
  trial.fit.phases = std::move(left.phases);
  trial.squares = sum_of_squares(left.residuals);
  trial.train = error_of(mean_squares(left.residuals));
  std::optional<Squares> named;  // where training runs judge, too
  if (!data_.held_out.empty()) {
    ResidualsAtPhases unseen = residuals_at_best_phases(data_.held_out, model, model.values(), {},
                                                        known != nullptr ? known->held_out_phases : RotorPhases{});
    trial.held_out.add(data_.held_out, unseen.residuals);
    trial.held_out_phases = std::move(unseen.phases);
    if (training_judges_) {
      trial.named_error = trial.held_out.error();
      named = trial.held_out.squares();
      leave_one_out(trial, options);
    }
  } else if (data_.train.size() == 1) {
    trial.held_out.add(data_.train, left.residuals);
  } else {
    leave_one_out(trial, options);
  }
  trial.held_out.quality = quality_in_training(
      left.residuals, FreeParameters(model).size() + found_in(trial.fit.phases) + found_in(trial.held_out_phases));
  const bool judged_on_training = data_.held_out.empty() && data_.train.size() == 1;
  // The likelihood of training runs is in it already: beside runs that were named they do not count twice.
  if (!judged_on_training) trial.held_out.quality->held_out = named.value_or(trial.held_out.squares());
  return trial;
}

void FittedTrials::leave_one_out(Trial& trial, const CalibrationOptions& options) const {
  const std::vector<Model> judging = judged_in_turn(data_.train, trial.fit, options);
  for (std::size_t out = 0; out < data_.train.size(); ++out) {
    const std::span<const Record> alone(&data_.train[out], 1);
    const RotorPhases near{trial.fit.phases[out]};
    trial.held_out.add(alone, residuals_at_best_phases(alone, judging[out], judging[out].values(), {}, near).residuals);
  }
}

Quality FittedTrials::quality_in_training(std::span<const Residuals> left, std::size_t free_parameters) const {
  return {squares_of(data_.train, left), {}, memory_of(spectra_of(data_.train, left)), free_parameters};
}

Quality FittedTrials::quality_in_training(const Fit& fit) const {
  return quality_in_training(
      residuals_at_best_phases(data_.train, fit.model, fit.model.values(), {}, fit.phases).residuals,
      FreeParameters(fit.model).size() + found_in(fit.phases));
}

Loss FittedTrials::loss_on(std::span<const Record> runs, const Model& model, const RotorPhases& phases) const {
  Loss loss(data_.noise);
  loss.add(runs, residuals_at_best_phases(runs, model, model.values(), {}, phases).residuals);
  return loss;
}

std::vector<Score> FittedTrials::scores(const Trial& fitted) {
  if (exhausted()) return {};
  std::vector<std::size_t> absent = absent_effects(fitted.model());
  std::vector<Score> scores = score(data_.train, fitted.model(), absent, score_);
  scored_ = {std::move(absent), fitted.fit.cost, std::move(scores)};
  return scored_.scores;
}

std::vector<Score> FittedTrials::scores_about(const Trial& fitted) {
  constexpr double as_good = 0.01;  // no decision is about less of the cost
  const bool is_the_same = scored_.absent == absent_effects(fitted.model()) &&
                           std::abs(fitted.fit.cost - scored_.cost) <= as_good * scored_.cost;
  return is_the_same ? scored_.scores : scores(fitted);
}

Refits FittedTrials::refits(const Trial& fitted, const std::vector<Score>& all, Breadth breadth) {
  constexpr double far_less = 0.3;  // of what the best takes off the cost, or adds to the likelihood; by hand
  const std::vector<Score> best =
      breadth == Breadth::promising
          ? worth_a_refit(all, fitted.model(), refits_, score_)
          : from_clear_sizes_too(all, fitted.model(), machine_of(data_.train, fitted.model()));
  if (best.empty() || exhausted()) return {};
  std::vector<Fit> begun(best.size());
  std::vector<double> gains(best.size()), drops(best.size());
  const bool from_given_too = breadth != Breadth::promising || criterion_.far_off(fitted.held_out);
  Quality before = *fitted.held_out.quality;
  before.held_out.clear();  // what is only begun is not tried on other runs
  std::vector<Fit> anew = from_given_too ? begun_anew(fitted, best) : std::vector<Fit>{};
  if (exhausted()) return {};
  // Models side by side: records are often fewer, or of very different lengths.
  each_on_a_core(best.size(), [&](std::size_t i) {
    begun[i] =
        ends_now() ? nowhere(fitted.model()) : begun_refit(data_.train, fitted.fit, fitted.squares, best[i], valleys_);
    if (from_given_too && anew[i].cost < begun[i].cost) begun[i] = std::move(anew[i]);
    drops[i] = std::max(0.0, fitted.fit.cost - begun[i].cost);
    gains[i] = drops[i] > 0 ? gain(before, quality_in_training(begun[i])) : 0;
  });
  const double most_gained = std::ranges::max(gains), most_dropped = std::ranges::max(drops);
  std::vector<Begun> going;
  Refits refits;
  for (std::size_t i = 0; i < best.size(); ++i) {
    const bool near_the_best = drops[i] >= far_less * most_dropped || gains[i] >= far_less * most_gained;
    std::vector<Begun>& these = drops[i] > 0 && near_the_best ? going : refits.broken_off;
    these.push_back({best[i], std::move(begun[i])});
  }
  refits.done = ended(fitted, going);
  return refits;
}

std::vector<Addition> FittedTrials::go_on(const Trial& fitted, const std::vector<Begun>& begun) {
  constexpr double anything = 1e-3;  // of the cost; by hand
  if (begun.empty() || exhausted()) return {};
  std::vector<Score> scores;
  for (const Begun& b : begun) scores.push_back(b.score);
  // From the base as given half of them are left behind on the way: now the others have gone.
  std::vector<Fit> anew = begun_anew(fitted, std::move(scores));
  std::vector<Begun> going = begun;
  for (std::size_t i = 0; i < going.size(); ++i) {
    if (anew[i].cost < going[i].fit.cost) going[i].fit = std::move(anew[i]);
  }
  std::erase_if(going, [&](const Begun& b) { return fitted.fit.cost - b.fit.cost <= anything * fitted.fit.cost; });
  return ended(fitted, going);
}

std::vector<Addition> FittedTrials::ended(const Trial& fitted, std::span<const Begun> begun) {
  if (exhausted()) return {};
  std::vector<std::optional<Trial>> trials(begun.size());
  each_on_a_core(begun.size(), [&](std::size_t i) {
    if (ends_now()) return;
    const Model& model = begun[i].fit.model;
    const Model start = held_nearer(data_.train, given_, model).value_or(model);
    trials[i] = attempt([&] { return this->fitted(start, of_a_search(), known_for(begun[i].score.effect, fitted)); });
  });
  std::vector<Addition> additions;
  for (std::size_t i = 0; i < begun.size(); ++i) {
    if (!trials[i]) continue;
    const std::size_t effect = begun[i].score.effect;
    additions.push_back({begun[i].score, std::move(*trials[i])});
    valleys_[effect] = valley_of(additions.back().trial.model(), effect);  // for later rounds to start from
    known_fits_.remember(additions.back().trial.model());
  }
  return additions;
}

/// Refits begun where the base parameters are as given, the pins among them free: those of a model that lacks
/// something may have bent so far that no descent leads back, and a pin that had to follow them would block the way.
/// All begin alike, so that the costs along the way tell which are worth more of it.
std::vector<Fit> FittedTrials::begun_anew(const Trial& fitted, std::vector<Score> scores) const {
  constexpr std::array on_the_way{3, 7};  // steps, to which the better half goes on each time
  constexpr std::size_t few = 4;          // of which none is left behind
  Fit anew = fitted.fit;
  for (Parameter& p : anew.model.base) {
    if (p.pinned) p.fixed = p.pinned = false;
  }
  anew.model = with_base_as_given(anew.model, given_);
  SquaresAtPhases from = squares_at_best_phases(data_.train, anew.model);
  anew.phases = std::move(from.phases);
  const double squares = from.squares;
  std::vector<Fit> begun(scores.size());
  each_on_a_core(scores.size(), [&](std::size_t i) {
    for (Score::Start& start : scores[i].starts) start.others.clear();  // they belong to the fitted values
    begun[i] = ends_now() ? nowhere(anew.model) : begun_refit(data_.train, anew, squares, scores[i]);
  });
  std::vector<Fit*> going;
  for (Fit& fit : begun) {
    if (fit.cost < infinity) going.push_back(&fit);
  }
  for (const int steps : on_the_way) {
    std::ranges::stable_sort(going, {}, &Fit::cost);
    going.resize(std::min(going.size(), std::max(few, (going.size() + 1) / 2)));
    each_on_a_core(going.size(),
                   [&](std::size_t i) { *going[i] = first_steps(data_.train, going[i]->model, steps, {}); });
  }
  for (Fit& fit : begun) {
    for (std::size_t i = 0; i < fit.model.base.size(); ++i) {  // held again, where it has come to
      if (fitted.model().base[i].pinned) fit.model.base[i].fixed = fit.model.base[i].pinned = true;
    }
  }
  return begun;
}

std::optional<Addition> FittedTrials::refit_at_whole_orders(const Trial& fitted) {
  constexpr double worth_going_on = 0.05;  // of the largest remainder; by hand
  const std::vector<std::size_t> waves = absent_waves(fitted.model());
  if (!criterion_.worth_a_wide_search(fitted.held_out) || waves.empty() || exhausted()) return {};
  auto begun = begun_at_whole_orders(data_.train, fitted.fit, fitted.squares, waves, score_, valleys_);
  if (!begun) return {};
  const double left = largest_excess(loss_on(data_.train, fitted.model(), fitted.fit.phases));
  if (largest_excess(loss_on(data_.train, begun->fit.model, begun->fit.phases)) > (1 - worth_going_on) * left)
    return {};
  std::optional<Trial> trial = fit(begun->fit.model, nullptr);
  if (!trial) return {};
  return Addition{std::move(begun->score), std::move(*trial)};
}

std::optional<Pair> FittedTrials::refit_of_two(const Trial& fitted, const std::vector<Score>& scores,
                                               const std::vector<std::size_t>& added) {
  constexpr int few = 4;             // steps, by which
  constexpr double half_way = 0.25;  // of the largest remainder must be gone for a fit to go on; by hand
  const Loss& alone = fitted.held_out;
  if (!criterion_.worth_a_wide_search(alone) || exhausted()) return std::nullopt;
  const double left_in_training = largest_excess(loss_on(data_.train, fitted.model(), fitted.fit.phases));
  const std::vector<Score> best = worth_pairing(scores, fitted, added, score_);
  std::optional<Pair> found;
  for (std::size_t i = 0; i + 1 < best.size(); ++i) {
    if (exhausted()) break;
    const Trial* known_one = known_for(best[i].effect, fitted);
    const auto one = with_effect(data_.train, fitted.model(), fitted.squares, best[i].effect, best[i].starts.front(),
                                 phases_of(known_one));
    if (!one) continue;
    for (std::size_t j = i + 1; j < best.size(); ++j) {
      Score::Start start = best[j].starts.front();
      start.others.clear();  // they belong to a model without the first
      const Trial* known_other = known_for(best[j].effect, fitted);
      const Trial* known = known_one != nullptr ? known_other : nullptr;
      const auto both = with_effect(data_.train, one->model, one->squares, best[j].effect, start,
                                    known_other != nullptr ? one->phases : RotorPhases{});
      if (!both) continue;
      const Fit begun = first_steps(data_.train, both->model, few, both->phases);
      if (largest_excess(loss_on(data_.train, begun.model, begun.phases)) > (1 - half_way) * left_in_training) continue;
      std::optional<Trial> trial = fit(begun.model, known);
      if (!trial) continue;
      Pair pair{{best[i].effect, best[j].effect}, std::move(*trial)};
      if (!removes_most(alone, pair.trial.held_out)) continue;
      if (found && found->trial.held_out.error() <= pair.trial.held_out.error()) continue;
      if (!criterion_.material(alone, pair.trial.held_out)) continue;
      if (!determined(pair.trial.model(), pair.effects[0]) || !determined(pair.trial.model(), pair.effects[1]))
        continue;
      found = std::move(pair);
    }
  }
  return found;
}

bool FittedTrials::determined(const Model& fitted, std::size_t effect) {
  // What quick errors lack is no reason to doubt that it is there.
  const Fit judged = with_standard_errors(data_.train, fitted, true);
  return told_from_zero(judged, effect) && may_be(judged, effect);
}

bool FittedTrials::can_be(const Model& fitted, std::size_t effect) {
  return may_be(with_standard_errors(data_.train, fitted, true), effect);
}

bool FittedTrials::determined_but_for_scale(const Model& fitted, std::size_t effect) {
  const Fit judged = with_standard_errors(data_.train, fitted, true);
  return told_but_for_scale(data_.train, judged, effect) && may_be(judged, effect);
}

/// Are its values those that the effect may have? What speaks against it is kept.
bool FittedTrials::may_be(const Fit& judged, std::size_t effect) {
  std::string objection = implausible_value(data_.train, judged.model, effect);
  if (objection.empty() && !keeps_step(data_.train, judged, effect)) {
    objection = "its order is not told: a wave that keeps step with the angle would";
  }
  if (objection.empty()) objection = pushed_to_a_bound(judged);
  if (objection.empty()) {
    refused_.erase(effect);
    return true;
  }
  refused_.insert_or_assign(effect, std::move(objection));
  return false;
}

/// A base parameter that an effect drives to a bound where the model as given has none: J_2 takes the place of J.
std::string FittedTrials::pushed_to_a_bound(const Fit& judged) const {
  const std::vector<std::string> names = judged.model.names();
  for (std::size_t i = 0; i < ModelStructure::base_count; ++i) {
    const Parameter& p = judged.model.at(i);
    const std::string& name = names[i];
    const bool can_be_nothing = p.value == p.min && p.min <= 0;  // what another effect does in its place
    if (can_be_nothing || std::ranges::find(judged.at_bound, name) == judged.at_bound.end()) continue;
    if (std::ranges::find(on_bounds_at_first_, name) != on_bounds_at_first_.end()) continue;
    if (carried_along(data_.train, judged.model, i)) continue;  // the bound ends a valley, and means nothing
    return name + " is then driven to its bound, where it was not before";
  }
  return {};
}

/// The runs of which a model leaves a remainder.
std::vector<const Record*> FittedTrials::unexplained(std::span<const Record> runs, const Model& model,
                                                     const RotorPhases& phases) const {
  std::vector<const Record*> left;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const RotorPhases known = phases.empty() ? RotorPhases{} : RotorPhases{phases[i]};
    if (criterion_.remainder(loss_on(runs.subspan(i, 1), model, known))) left.push_back(&runs[i]);
  }
  return left;
}

bool FittedTrials::explains_most_runs(const Trial& trial) {
  const std::size_t left = unexplained(data_.train, trial.model(), trial.fit.phases).size() +
                           unexplained(data_.held_out, trial.model(), trial.held_out_phases).size();
  return 3 * left <= data_.train.size() + data_.held_out.size();
}

bool FittedTrials::training_shows_more(const Trial& trial) const {
  constexpr double far_more = 2;  // times what is left beyond the floor
  if (data_.held_out.empty() || data_.train.size() < 2) return false;
  const Loss training = loss_on(data_.train, trial.model(), trial.fit.phases);
  const std::vector<Signal> judged = trial.held_out.signals();
  return std::ranges::any_of(training.signals(), [&](Signal signal) {
    if (!criterion_.remainder_in(training, signal)) return false;
    const bool is_judged = std::ranges::find(judged, signal) != judged.end();
    if (!is_judged || !criterion_.remainder_in(trial.held_out, signal)) return true;
    return training.mean_square(signal) - 1 > far_more * (trial.held_out.mean_square(signal) - 1);
  });
}

std::vector<std::string> FittedTrials::runs_that_alone_show_a_remainder(const Trial& trial) const {
  constexpr double by_far = 3;  // times what training runs leave: another effect
  const bool all_explained = unexplained(data_.train, trial.model(), trial.fit.phases).empty();
  const double of_training = loss_on(data_.train, trial.model(), trial.fit.phases).error();
  std::vector<std::pair<double, std::string>> shown;
  for (const Record* run : unexplained(data_.held_out, trial.model(), trial.held_out_phases)) {
    const double error = loss_on(std::span(run, 1), trial.model(), {}).error();
    if (all_explained || error > by_far * of_training) shown.emplace_back(error, run->name);
  }
  std::ranges::stable_sort(shown, std::greater{}, &std::pair<double, std::string>::first);
  std::vector<std::string> names;
  for (auto& [error, name] : shown) names.push_back(std::move(name));
  return names;
}

}  // namespace emtb
