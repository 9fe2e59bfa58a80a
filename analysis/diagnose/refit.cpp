#include "analysis/diagnose/refit.h"

#include <algorithm>
#include <cmath>

#include "analysis/diagnose/moves.h"
#include "analysis/diagnose/plausibility.h"
#include "model/effect.h"

namespace emtb {

std::optional<RefitStart> with_effect(std::span<const Record> records, const Model& fitted, double squares,
                                      std::size_t effect, const Score::Start& start,
                                      std::span<const RotorPhase> phases) {
  const FreeParameters free(fitted);
  const EffectInfo& about = fitted.about(effect);
  const auto at = [&](double share) {
    Model extended = fitted;
    for (std::size_t i = 0; i < start.others.size(); ++i) {
      Parameter& p = extended.at(free.places()[i]);
      p.value = std::clamp(p.value + std::min(share, 1.0) * start.others[i], p.min, p.max);
    }
    extended.include(effect);
    std::vector<Parameter>& added = extended.parameters_of(effect);
    for (std::size_t i = 0; i < added.size(); ++i) {
      Parameter& p = added[i];
      if (p.fixed) continue;
      const double part = about.parameter_list[i].is_shape() ? std::min(share, 1.0) : share;
      p.value = std::clamp(start.from[i] + part * (start.expected[i] - start.from[i]), p.min, p.max);
    }
    return extended;
  };
  RefitStart best;
  best.phases.assign(phases.begin(), phases.end());
  // The phases are searched for the whole way, and followed from there.
  const auto look_at = [&](double share) {
    Model there = at(share);
    SquaresAtPhases seen = squares_at_best_phases(records, there, best.phases);
    return RefitStart{std::move(there), seen.squares, std::move(seen.phases)};
  };
  best = look_at(1);
  // The score is linear; what it expects of an effect that another imitates can be far off.
  for (const double share : {0.5, 0.2, 0.05}) {
    if (best.squares < squares) break;
    if (RefitStart nearer = look_at(share); !(nearer.squares >= best.squares)) best = std::move(nearer);
  }
  // It sees only as much of a wave as keeps step with the measured angle, which wanders.
  for (double share = 2; about.periodic && best.squares < squares && share <= 16; share *= 2) {
    RefitStart larger = look_at(share);
    if (!(larger.squares < best.squares)) break;
    best = std::move(larger);
  }
  if (!std::isfinite(best.squares)) return std::nullopt;
  return best;
}

Fit first_steps(std::span<const Record> records, const Model& start, int iterations, RotorPhases phases) {
  return fit_or_none(records, start,
                     {.extra_starts = 0,
                      .max_iterations = iterations,
                      .tolerance = 1e-3,
                      .with_covariance = false,
                      .phases = std::move(phases)});
}

bool keeps_phases(std::size_t effect, const Model& model) {
  const EffectInfo& about = model.about(effect);
  return !about.periodic && about.reads != Signal::omega;
}

Fit nowhere(const Model& model) { return {.model = model, .cost = infinity, .at_bound = {}, .phases = {}}; }

Fit begun_refit(std::span<const Record> records, const Fit& fitted, double squares, const Score& score,
                const Valleys& valleys) {
  constexpr int few = 4, first_look = 2;  // steps
  constexpr std::size_t go_on = 2;
  std::vector<Score::Start> starts = score.starts;
  const auto known_valley = valleys.find(score.effect);
  const Valley* valley = known_valley != valleys.end() ? &known_valley->second : nullptr;
  if (valley != nullptr && starts.size() > 1) {
    starts.resize(1);
    starts.push_back({valley->own, valley->own, {}});
  }
  const RotorPhases known = keeps_phases(score.effect, fitted.model) ? fitted.phases : RotorPhases{};
  const bool together = acts_within_another(fitted.model, score.effect);
  std::vector<Fit> begun;
  for (const Score::Start& start : starts) {
    const auto there = with_effect(records, fitted.model, squares, score.effect, start, known);
    if (!there) continue;
    begun.push_back(first_steps(records, there->model, starts.size() > go_on ? first_look : few, there->phases));
  }
  if (begun.empty() && !together) return nowhere(fitted.model);
  std::ranges::stable_sort(begun, {}, &Fit::cost);
  if (begun.size() > go_on) {
    begun.resize(go_on);
    for (Fit& f : begun) f = first_steps(records, f.model, few - first_look, known);
  }
  if (together) begun.push_back(begun_together(records, fitted, score.effect, known, valley));
  return *std::ranges::min_element(begun, {}, &Fit::cost);
}

namespace {

/// The orders of a wave at which a refit is worth going on, as a first look at a few runs tells, the best first.
/// @param squares what the fitted model leaves there
std::vector<Score::Start> best_orders(std::span<const Record> runs, const Model& fitted, double squares,
                                      const Score& score) {
  constexpr int first_look = 2;  // steps
  constexpr std::size_t go_on = 2;
  std::vector<std::pair<double, Score::Start>> begun;
  for (const Score::Start& start : score.starts) {
    const auto there = with_effect(runs, fitted, squares, score.effect, start);
    if (!there) continue;
    const Fit f = first_steps(runs, there->model, first_look, there->phases);
    const std::vector<double> values = values_of(f.model.parameters_of(score.effect));
    begun.push_back({f.cost, {values, values, {}}});
  }
  std::ranges::stable_sort(begun, {}, &std::pair<double, Score::Start>::first);
  std::vector<Score::Start> best;
  for (std::size_t i = 0; i < std::min(go_on, begun.size()); ++i) best.push_back(begun[i].second);
  return best;
}

}  // namespace

std::optional<BegunAtWholeOrders> begun_at_whole_orders(std::span<const Record> records, const Fit& fitted,
                                                        double squares, std::span<const std::size_t> effects,
                                                        const ScoreOptions& options, const Valleys& valleys) {
  ScoreOptions all = options;
  all.whole_orders = true;
  const std::vector<Score> scored = promising(score(records, fitted.model, effects, all), options);
  if (scored.empty()) return std::nullopt;
  const ShortestRecords shortest(records);
  const double squares_there = squares_at_best_phases(shortest.all(), fitted.model).squares;
  std::optional<BegunAtWholeOrders> best;
  for (Score wave : scored) {
    wave.starts = best_orders(shortest.all(), fitted.model, squares_there, wave);
    if (wave.starts.empty()) continue;
    Fit begun = begun_refit(records, fitted, squares, wave, valleys);
    if (!best || begun.cost < best->fit.cost) best = BegunAtWholeOrders{std::move(wave), std::move(begun)};
  }
  return best;
}

Model with_base_as_given(Model model, const Model& given) {
  for (std::size_t i = 0; i < model.base.size(); ++i) {
    if (!model.base[i].fixed) model.base[i] = given.base[i];
  }
  return model;
}

namespace {

/// A fitted model with an effect where that is absent.
Fit where_it_is_absent(std::span<const Record> records, const Fit& fitted, const Score& score) {
  Model model = fitted.model;
  model.include(score.effect);
  std::vector<Parameter>& added = model.parameters_of(score.effect);
  for (std::size_t i = 0; i < added.size(); ++i) {
    if (!added[i].fixed) added[i].value = std::clamp(score.starts.front().from[i], added[i].min, added[i].max);
  }
  return first_steps(records, model, 0, {});
}

}  // namespace

Fit begun_refit_with(std::span<const Record> records, const Fit& fitted, const Model& given, std::size_t effect,
                     const ScoreOptions& options) {
  constexpr int far_enough = 40;  // steps: one fit that somebody waits for, and what begins slowly may end best
  const double squares = squares_at_best_phases(records, fitted.model, fitted.phases).squares;
  const Score scored = score(records, fitted.model, std::vector{effect}, options).front();
  const std::vector<Score> clearer = from_clear_sizes_too({scored}, fitted.model, machine_of(records, fitted.model));
  std::vector<Fit> begun{begun_refit(records, fitted, squares, clearer.empty() ? scored : clearer.front())};
  Score from_given = scored;
  for (Score::Start& start : from_given.starts) start.others.clear();  // they belong to the fitted values
  Fit anew{.model = with_base_as_given(fitted.model, given), .cost = fitted.cost, .at_bound = {}, .phases = {}};
  SquaresAtPhases there = squares_at_best_phases(records, anew.model);
  anew.phases = std::move(there.phases);
  begun.push_back(begun_refit(records, anew, there.squares, from_given));
  if (fitted.model.about(effect).is_wave()) {
    auto whole = begun_at_whole_orders(records, fitted, squares, std::vector{effect}, options);
    if (whole) begun.push_back(std::move(whole->fit));
  }
  std::erase_if(begun, [](const Fit& fit) { return !std::isfinite(fit.cost); });
  for (Fit& fit : begun) fit = first_steps(records, fit.model, far_enough, {});
  const auto best = std::ranges::min_element(begun, {}, &Fit::cost);
  if (best != begun.end() && 2 * best->cost < squares) return std::move(*best);
  Fit absent = where_it_is_absent(records, fitted, scored);
  return best != begun.end() && best->cost < absent.cost ? std::move(*best) : std::move(absent);
}

}  // namespace emtb
