#include "analysis/diagnose/diagnose.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <optional>

#include "analysis/diagnose/refit_start.h"
#include "hal/error.h"
#include "model/catalogue.h"

namespace emtb {
namespace {

/// Friction that falls with speed is a part of dry friction: without that it makes no sense.
bool makes_sense(std::size_t effect, const Model& model) {
  const std::string_view needs = model.about(effect).needs;
  return needs.empty() || model.includes(effect_index(needs));
}

/// Does some effect of the model need this one?
bool needed(std::size_t effect, const Model& model) {
  return std::ranges::any_of(model.effects, [&](const IncludedEffect& e) {
    return effect_catalogue()[e.effect].needs == model.about(effect).id;
  });
}

/// A sensor's error shows in its own reading. A gain elsewhere that this has no part in is a makeshift: a lag of the
/// gauge stands in for the noise of a load.
bool shows_itself(const EffectInfo& effect, const Loss& without, const Loss& with) {
  if (!effect.reads) return true;
  const auto differences = Loss::difference(without, with);
  const auto own = differences.find(*effect.reads);
  return own == differences.end() || own->second.gain > 0;
}

/// Which of the effects found shapes the same edges as this one, if any?
std::optional<std::size_t> kin_of(std::size_t effect, const std::vector<std::size_t>& found, const Model& model) {
  const EffectInfo& about = model.about(effect);
  for (const std::size_t other : found) {
    if (other != effect && about.same_family(model.about(other))) return other;
  }
  return std::nullopt;
}

/// A model fitted to the training runs and judged on runs that it never saw.
struct Trial {
  Model model;
  double cost = 0;     ///< of the fit
  double squares = 0;  ///< of the residuals on the training runs
  double train = 0;
  Loss held_out;
  RotorPhases phases, held_out_phases;  ///< of the runs
};

/// A fitted model, the scores of what is absent from it, and the refits of the best of them.
struct Round {
  Trial fitted;
  std::vector<Score> scores;
  std::vector<std::pair<Score, Trial>> refits;
};

/// The best of several refits that all removed something material: lowest loss, but at equal gain the fewest
/// parameters.
const std::pair<Score, Trial>* best_of(const std::vector<std::pair<Score, Trial>>& trials, const Trial& current,
                                       const Materiality& rule) {
  const std::pair<Score, Trial>* best = nullptr;
  for (const auto& t : trials) {
    if (material(current.held_out, t.second.held_out, rule) &&
        (best == nullptr || t.second.held_out.error() < best->second.held_out.error())) {
      best = &t;
    }
  }
  if (best == nullptr) return nullptr;
  const auto parameter_count = [](const std::pair<Score, Trial>& t) {
    return t.second.model.about(t.first.effect).parameter_count;
  };
  for (const auto& t : trials) {
    if (parameter_count(t) < parameter_count(*best) && material(current.held_out, t.second.held_out, rule) &&
        tied(best->second.held_out, t.second.held_out, rule)) {
      best = &t;
    }
  }
  return best;
}

class Search {
 public:
  Search(const Dataset& data, const DiagnoseOptions& options) : data_(data), options_(options) {}

  /// The fit, as one whose phases hold with an effect more or less: unless that repeats with the angle itself, or moves
  /// an angle that is the integral of the speed's reading.
  static const Trial* known_for(std::size_t effect, const Trial& fit) {
    const EffectInfo& about = fit.model.about(effect);
    return about.periodic || about.reads == Signal::omega ? nullptr : &fit;
  }

  /// Fits; several starts only where nothing good is known to start from.
  /// @param known a fit whose phases hold for this one, if the same repeats with the angle in both
  Trial fit(const Model& start, const Trial* known = nullptr, int extra_starts = 0) const {
    // No decision is about less than a hundredth of the cost; what creeps on below this is not determined.
    return fit(start, {.extra_starts = extra_starts, .max_iterations = 25, .tolerance = 1e-5, .with_covariance = false},
               known);
  }

  /// Fits to the end what is kept: the last of a delay, which creeps along its edges, must not be left for the next
  /// effect to find.
  Trial fit_to_the_end(const Model& start, int extra_starts = 0) const {
    return fit(start,
               {.extra_starts = extra_starts, .max_iterations = 40, .tolerance = 1e-8, .with_covariance = false});
  }

  /// None where it cannot be simulated from there: the search passes it over.
  template <class Fit>
  static std::optional<Trial> attempt(const Fit& fit) {
    try {
      return fit();
    } catch (const ModelError&) {
      return std::nullopt;
    }
  }
  std::optional<Trial> try_fit(const Model& start, const Trial* known = nullptr) const {
    return attempt([&] { return fit(start, known); });
  }

  /// The same, and where a remainder is left also from elsewhere. The base parameters of a model that lacked something
  /// may have bent into a valley of their own: the time constants of a shaft and of its tacho had changed places.
  std::optional<Trial> fit_from_elsewhere_too(const Model& start, const Model& given) const {
    std::optional<Trial> fitted = attempt([&] { return fit_to_the_end(start); });
    if (!fitted || !remainder(fitted->held_out, options_.materiality)) return fitted;
    Model anew = fitted->model;
    anew.base = given.base;
    std::optional<Trial> other = attempt([&] { return fit_to_the_end(anew, 4); });
    return other && material(fitted->held_out, other->held_out, options_.materiality) ? other : fitted;
  }

  Trial fit(const Model& start, CalibrationOptions options, const Trial* known = nullptr) const {
    Trial trial{{}, 0, 0, 0, Loss(data_.noise), {}, {}};
    options.phases = phases_of(known);
    Calibration fitted = calibrate(data_.train, start, options);
    trial.model = std::move(fitted.model);
    trial.cost = fitted.cost;
    ResidualsAtPhases left = residuals_at_best_phases(data_.train, trial.model, trial.model.values(), {},
                                                      known != nullptr ? fitted.phases : RotorPhases{});
    trial.phases = std::move(left.phases);
    trial.squares = sum_of_squares(left.residuals);
    trial.train = error_of(mean_squares(left.residuals));
    if (!data_.held_out.empty()) {
      ResidualsAtPhases unseen = residuals_at_best_phases(data_.held_out, trial.model, trial.model.values(), {},
                                                          known != nullptr ? known->held_out_phases : RotorPhases{});
      trial.held_out.add(data_.held_out, unseen.residuals);
      trial.held_out_phases = std::move(unseen.phases);
    } else if (data_.train.size() == 1) {
      trial.held_out.add(data_.train, left.residuals);
    } else {
      leave_one_out(trial, std::move(options));
    }
    return trial;
  }

  /// No calibration: the model as it is, at infinite cost.
  static Calibration nowhere(const Model& model) {
    Calibration none;
    none.model = model;
    none.cost = infinity;
    return none;
  }

  /// A calibration; none where nothing can be simulated from there.
  static Calibration calibrated(std::span<const PreparedRun> runs, const Model& start, CalibrationOptions options) {
    try {
      return calibrate(runs, start, std::move(options));
    } catch (const ModelError&) {
      return nowhere(start);
    }
  }

  /// A fitted model with its standard errors.
  Model judged(const Model& fitted, bool quick = false) const {
    CalibrationOptions as_it_is;
    as_it_is.extra_starts = as_it_is.max_iterations = 0;
    as_it_is.quick_errors = quick;
    return calibrated(data_.train, fitted, as_it_is).model;
  }

  /// Do the data tell the size of an effect, to three standard errors that hold for coloured residuals? A gain that
  /// several parameters of the model share out among themselves is nobody's.
  bool determined(const Model& fitted, std::size_t effect) const {
    const Model judged = this->judged(fitted, true);  // what its errors lack is no reason to doubt that it is there
    const EffectInfo& about = judged.about(effect);
    const std::vector<Parameter>& included = judged.parameters_of(effect);
    bool any_amplitude = false;
    for (std::size_t i = 0; i < about.parameter_count; ++i) {
      const EffectParameter& p = about.parameter_list[i];
      if (p.is_shape()) continue;
      any_amplitude = true;
      const Parameter& found = included[i];
      if (found.value == p.null) continue;  // it rests where the effect is absent
      const bool on_bound = found.value <= found.min || found.value >= found.max;
      const double size = p.null == infinity || p.role == Role::limit ? found.value : found.value - p.null;
      if (on_bound || (found.std_error && std::abs(size) > 3 * *found.std_error)) return true;
    }
    return !any_amplitude;
  }

  /// Two effects that hide each other: where no single one helps, both together may explain most of what is left.
  struct Two {
    std::array<std::size_t, 2> effects{};
    Trial trial;
  };
  std::optional<Two> two_at_once(const Round& round, const std::vector<std::size_t>& added,
                                 const Materiality& rule) const {
    constexpr std::size_t tried = 4;    // the best scored: six pairs
    constexpr double most_of_it = 0.5;  // of the largest remainder: two amplitudes can do a little of anything
    constexpr int few = 4;              // steps, by which
    constexpr double half_way = 0.5;    // of that must be done for a fit to go on
    const Loss& alone = round.fitted.held_out;
    const double left = largest_excess(alone);
    if (left < rule.remainder) return std::nullopt;
    const double left_in_training = largest_excess(loss_on(data_.train, round.fitted.model, round.fitted.phases));
    std::vector<Score> best = promising(round.scores, options_.score);
    std::erase_if(best, [&](const Score& s) {
      return !makes_sense(s.effect, round.fitted.model) || kin_of(s.effect, added, round.fitted.model);
    });
    if (best.size() > tried) best.resize(tried);
    std::optional<Two> found;
    for (std::size_t i = 0; i + 1 < best.size(); ++i) {
      const Trial* known_one = known_for(best[i].effect, round.fitted);
      const auto one = with_effect(data_.train, round.fitted.model, round.fitted.squares, best[i].effect,
                                   best[i].starts.front(), phases_of(known_one));
      if (!one) continue;
      for (std::size_t j = i + 1; j < best.size(); ++j) {
        Score::Start start = best[j].starts.front();
        start.others.clear();  // they belong to a model without the first
        const Trial* known_other = known_for(best[j].effect, round.fitted);
        const Trial* known = known_one != nullptr ? known_other : nullptr;
        const auto both = with_effect(data_.train, one->model, one->squares, best[j].effect, start,
                                      known_other != nullptr ? one->phases : RotorPhases{});
        if (!both) continue;
        const Calibration begun = first_steps(both->model, few, both->phases);
        if (largest_excess(loss_on(data_.train, begun.model, begun.phases)) >
            (1 - half_way * most_of_it) * left_in_training)
          continue;
        std::optional<Trial> trial = try_fit(begun.model, known);
        if (!trial) continue;
        Two two{{best[i].effect, best[j].effect}, std::move(*trial)};
        if (largest_excess(two.trial.held_out) > (1 - most_of_it) * left) continue;
        if (found && found->trial.held_out.error() <= two.trial.held_out.error()) continue;
        if (!material(alone, two.trial.held_out, rule)) continue;
        if (!determined(two.trial.model, two.effects[0]) || !determined(two.trial.model, two.effects[1])) continue;
        found = std::move(two);
      }
    }
    return found;
  }

  /// The refit of what pulls at a shaft that never turns slowly: it shows where the shaft starts and stops, in no
  /// spectrum. So where nothing else explains what is left, whole orders are tried one by one, on the shortest runs.
  std::optional<std::pair<Score, Trial>> whole_orders(const Round& round) {
    constexpr int glance = 2;
    constexpr std::size_t go_on = 2;
    constexpr double worth_going_on = 0.05;  // of the largest remainder
    const Trial& fitted = round.fitted;
    if (largest_excess(fitted.held_out) < options_.materiality.remainder) return {};
    std::vector<std::size_t> detents;
    for (std::size_t effect = 0; effect < effect_count; ++effect) {
      if (effect_catalogue()[effect].is_detent() && !fitted.model.includes(effect)) detents.push_back(effect);
    }
    if (detents.empty()) return {};
    ScoreOptions all = options_.score;
    all.whole_orders = true;
    const std::vector<Score> scored = promising(score(data_.train, fitted.model, detents, all), options_.score);
    if (scored.empty()) return {};
    Score best = scored.front();
    const std::vector<PreparedRun> runs = shortest_records(data_.train);
    const double squares = sum_of_squares(residuals(runs, fitted.model, fitted.model.values(), {}));
    std::vector<std::pair<double, Score::Start>> begun;
    for (const Score::Start& start : best.starts) {
      const auto toothed = with_effect(runs, fitted.model, squares, best.effect, start);
      if (!toothed) continue;
      const Calibration c = first_steps(runs, toothed->model, glance, toothed->phases);
      std::vector<double> there;
      for (const Parameter& p : c.model.parameters_of(best.effect)) there.push_back(p.value);
      begun.push_back({c.cost, {there, there, {}}});
    }
    if (begun.empty()) return {};
    std::ranges::stable_sort(begun, {}, &std::pair<double, Score::Start>::first);
    best.starts.clear();
    for (std::size_t i = 0; i < std::min(go_on, begun.size()); ++i) best.starts.push_back(begun[i].second);
    const Calibration started = first_steps(fitted, best);
    const double left = largest_excess(loss_on(data_.train, fitted.model, fitted.phases));
    if (largest_excess(loss_on(data_.train, started.model, started.phases)) > (1 - worth_going_on) * left) return {};
    std::optional<Trial> trial = try_fit(started.model);
    if (!trial) return {};
    return std::pair{best, std::move(*trial)};
  }

  /// What is found where a shaft's teeth are taken first, and after them what removes most, at most so many in all.
  struct Chain {
    std::vector<std::size_t> effects;
    std::map<std::size_t, Loss> before;  ///< each of them was added
    Trial trial;
  };
  std::optional<Chain> teeth_first(const Round& bare, std::size_t most) {
    Chain chain{{}, {}, bare.fitted};
    std::optional<std::pair<Score, Trial>> next = whole_orders(bare);
    while (next && chain.effects.size() < most && determined(next->second.model, next->first.effect)) {
      chain.before.insert_or_assign(next->first.effect, chain.trial.held_out);
      chain.effects.push_back(next->first.effect);
      chain.trial = std::move(next->second);
      const Round& after = *round(chain.effects, [&] { return chain.trial; });
      const auto* best = best_of(after.refits, chain.trial, options_.materiality);
      next = best != nullptr ? std::optional(*best) : std::nullopt;
    }
    if (chain.effects.empty()) return std::nullopt;
    if (auto kept = attempt([&] { return fit_to_the_end(chain.trial.model); })) chain.trial = std::move(*kept);
    return chain;
  }

  /// Does a fit leave nothing of most runs? A shaft that stops at another tooth than the model's spoils its run, and
  /// says nothing against the teeth.
  bool explains_most_runs(const Trial& trial) const {
    std::size_t explained = 0;
    const auto count = [&](std::span<const PreparedRun> runs, const RotorPhases& phases) {
      for (std::size_t i = 0; i < runs.size(); ++i) {
        const RotorPhases known = phases.empty() ? RotorPhases{} : RotorPhases{phases[i]};
        if (!remainder(loss_on(runs.subspan(i, 1), trial.model, known), options_.materiality)) ++explained;
      }
    };
    count(data_.train, trial.phases);
    count(data_.held_out, trial.held_out_phases);
    return 3 * explained >= 2 * (data_.train.size() + data_.held_out.size());
  }

  /// Two effects that explain all that the many do which were pieced together one by one, and leave nothing: the first
  /// step takes what removes most, which may be neither of them. So each of the others that came near is followed by
  /// one step.
  std::optional<Two> fewer(const Round& first, const Trial& many, std::size_t begun_with) {
    constexpr std::size_t followed = 3;
    constexpr double near = 0.5;  // of what the best first step removed of the cost
    if (first.refits.empty()) return std::nullopt;
    std::vector<const std::pair<Score, Trial>*> begun;
    for (const auto& refit : first.refits) begun.push_back(&refit);
    std::ranges::stable_sort(begun, {}, [](const auto* r) { return r->second.cost; });
    const double most = first.fitted.cost - begun.front()->second.cost;
    std::erase_if(begun, [&](const auto* r) {
      return r->first.effect == begun_with || first.fitted.cost - r->second.cost < near * most;
    });
    if (begun.size() > followed) begun.resize(followed);
    std::optional<Two> found;
    for (const auto* step : begun) {
      const auto& [score, trial] = *step;
      for (const auto& [second, both] : round({score.effect}, [&] { return trial; })->refits) {
        if (found && found->trial.held_out.error() <= both.held_out.error()) continue;
        if (remainder(both.held_out, options_.materiality)) continue;
        if (material(both.held_out, many.held_out, options_.materiality)) continue;
        if (!determined(both.model, score.effect) || !determined(both.model, second.effect)) continue;
        found = Two{{score.effect, second.effect}, both};
      }
    }
    return found;
  }

  /// The round of a model; the same effects are explored once. Null where it has no fit.
  const Round* round(const std::vector<std::size_t>& effects, const std::function<std::optional<Trial>()>& fitted) {
    std::vector<std::size_t> key = effects;
    std::ranges::sort(key);
    if (const auto known = rounds_.find(key); known != rounds_.end()) return &known->second;
    std::optional<Trial> trial = fitted();
    if (!trial) return nullptr;
    Round r{std::move(*trial), {}, {}};
    r.scores = scores(r.fitted.model);
    if (anything_left(r.fitted.held_out)) r.refits = refits(r.fitted, r.scores);
    return &rounds_.emplace(std::move(key), std::move(r)).first->second;
  }

 private:
  static double largest_excess(const Loss& loss) {
    double largest = 0;
    for (const auto& [signal, mean_square] : loss.mean_squares()) largest = std::max(largest, mean_square - 1);
    return largest;
  }

  Loss loss_on(std::span<const PreparedRun> runs, const Model& model, const RotorPhases& phases) const {
    Loss loss(data_.noise);
    loss.add(runs, residuals_at_best_phases(runs, model, model.values(), {}, phases).residuals);
    return loss;
  }

  static RotorPhases phases_of(const Trial* known) { return known != nullptr ? known->phases : RotorPhases{}; }

  /// Is some signal so far above its floor that anything material could be removed?
  bool anything_left(const Loss& loss) const { return largest_excess(loss) >= options_.materiality.least; }

  std::vector<Score> scores(const Model& fitted) const {
    std::vector<std::size_t> absent;
    for (std::size_t e = 0; e < fitted.known_effects(); ++e) {
      if (!fitted.includes(e)) absent.push_back(e);
    }
    return score(data_.train, fitted, absent, options_.score);
  }

  /// Refits of the best-scored candidates. All of them descend a few steps; those that by then remove far less than the
  /// best do not go on.
  std::vector<std::pair<Score, Trial>> refits(const Trial& fitted, const std::vector<Score>& all) {
    std::vector<Score> best = promising(all, options_.score);
    std::erase_if(best, [&](const Score& s) { return !makes_sense(s.effect, fitted.model); });
    if (best.size() > options_.refits) best.resize(options_.refits);
    std::erase_if(best, [&](const Score& s) { return s.predicted_drop < 0.03 * best.front().predicted_drop; });
    std::vector<Calibration> begun;
    double most = 0;
    for (const Score& s : best) {
      begun.push_back(first_steps(fitted, s));
      most = std::max(most, fitted.cost - begun.back().cost);
    }
    constexpr double far_less = 0.3;
    std::vector<std::pair<Score, Trial>> trials;
    for (std::size_t i = 0; i < best.size(); ++i) {
      if (fitted.cost - begun[i].cost < far_less * most) continue;
      std::optional<Trial> trial = try_fit(begun[i].model, known_for(best[i].effect, fitted));
      if (!trial) continue;
      trials.emplace_back(best[i], std::move(*trial));
      remember_valley(trials.back().second.model, best[i].effect);
    }
    return trials;
  }

  Calibration first_steps(const Model& start, int iterations, RotorPhases phases) const {
    return first_steps(data_.train, start, iterations, std::move(phases));
  }

  static Calibration first_steps(std::span<const PreparedRun> runs, const Model& start, int iterations,
                                 RotorPhases phases) {
    return calibrated(runs, start,
                      {.extra_starts = 0,
                       .max_iterations = iterations,
                       .tolerance = 1e-3,
                       .with_covariance = false,
                       .phases = std::move(phases)});
  }

  /// From where the score expects the effect. One that fades is scored where it stands, which tells little of where its
  /// valley lies: then from each place that was tried, or from the valley that an earlier round found. All take two
  /// steps, the best two go on, and the lowest counts.
  Calibration first_steps(const Trial& fitted, const Score& score) {
    constexpr int few = 4, glance = 2;
    constexpr std::size_t go_on = 2;
    std::vector<Score::Start> starts = score.starts;
    if (const auto valley = valleys_.find(score.effect); valley != valleys_.end() && starts.size() > 1) {
      starts.resize(1);
      starts.push_back({valley->second, valley->second, {}});
    }
    const Trial* known = known_for(score.effect, fitted);
    std::vector<Calibration> begun;
    for (const Score::Start& start : starts) {
      const auto there = with_effect(data_.train, fitted.model, fitted.squares, score.effect, start, phases_of(known));
      if (!there) continue;
      const bool many = starts.size() > go_on;
      begun.push_back(first_steps(there->model, many ? glance : few, many ? there->phases : phases_of(known)));
    }
    if (begun.empty()) return nowhere(fitted.model);
    std::ranges::stable_sort(begun, {}, &Calibration::cost);
    if (begun.size() > go_on) {
      begun.resize(go_on);
      for (Calibration& c : begun) c = first_steps(c.model, few - glance, phases_of(known));
    }
    return *std::ranges::min_element(begun, {}, &Calibration::cost);
  }

  /// Where the refit of an effect ended, for later rounds to start from.
  void remember_valley(const Model& model, std::size_t effect) {
    std::vector<double>& values = valleys_[effect];
    values.clear();
    for (const Parameter& p : model.parameters_of(effect)) values.push_back(p.value);
  }

  void leave_one_out(Trial& trial, CalibrationOptions options) const {
    const bool known = !options.phases.empty();
    for (std::size_t out = 0; out < data_.train.size(); ++out) {
      std::vector<PreparedRun> rest;
      options.phases.clear();
      for (std::size_t i = 0; i < data_.train.size(); ++i) {
        if (i == out) continue;
        rest.push_back(data_.train[i]);
        if (known) options.phases.push_back(trial.phases[i]);
      }
      const Model fitted = calibrate(rest, trial.model, options).model;
      const std::vector<PreparedRun> alone{data_.train[out]};
      trial.held_out.add(alone, residuals_at_best_phases(alone, fitted, fitted.values(), {},
                                                         known ? RotorPhases{trial.phases[out]} : RotorPhases{})
                                    .residuals);
    }
  }

  const Dataset& data_;
  const DiagnoseOptions& options_;
  std::map<std::vector<std::size_t>, Round> rounds_;    // by the effects added to the model as given
  std::map<std::size_t, std::vector<double>> valleys_;  // parameters of each effect where its last refit ended
};

/// Did anything move at all? Readings that never leave their noise inform nothing.
bool informative(const Dataset& data) {
  for (const PreparedRun& record : data.train) {
    for (const Observation& o : record.observations) {
      if (o.signal != Signal::omega && o.signal != Signal::i_a) continue;
      double mean = 0, squares = 0;
      for (const double v : o.value) mean += v / static_cast<double>(o.size());
      for (const double v : o.value) squares += (v - mean) * (v - mean);
      if (std::sqrt(squares / static_cast<double>(o.size())) > 5 * data.noise.at(o.signal).sigma) return true;
    }
  }
  return false;
}

void remember(std::vector<Candidate>& candidates, const Score& score, std::optional<double> held_out) {
  auto known = std::ranges::find(candidates, score.effect, [](const Candidate& c) { return c.score.effect; });
  if (known == candidates.end()) known = candidates.insert(candidates.end(), Candidate{score, {}});
  // The first score stands: it says what the effect would have explained of the model as it was given. What is
  // detectable is told by the last, when the others have been repaired.
  known->score.detectable_size = score.detectable_size;
  if (held_out && (!known->held_out_error || *held_out < *known->held_out_error)) known->held_out_error = held_out;
}

}  // namespace

std::string_view word(Verdict verdict) noexcept {
  switch (verdict) {
    case Verdict::found:
      return "found";
    case Verdict::tied:
      return "tied";
    case Verdict::unknown_effect:
      return "unknown_effect";
    case Verdict::nothing_missing:
      return "nothing_missing";
    case Verdict::cannot_tell:
      return "cannot_tell";
  }
  return "cannot_tell";
}

Diagnosis diagnose(std::span<const Run> train, std::span<const Run> held_out, const Model& model,
                   const DiagnoseOptions& options) {
  const Materiality& rule = options.materiality;
  const auto progress = [&](double share, const std::string& doing) {
    if (options.progress) options.progress(share, doing);
  };
  const auto id = [&](std::size_t effect) { return std::string(model.about(effect).id); };
  Diagnosis d;
  const Dataset data = prepare(train, held_out, model);
  d.left_one_out = held_out.empty() && train.size() > 1;
  d.judged_on_training = held_out.empty() && train.size() == 1;
  Search search(data, options);

  progress(0.02, "fitting the model as given");
  Trial current = search.fit(model, nullptr, 4);
  d.base = current.model;
  d.base_train = current.train;
  d.base_held_out = current.held_out.error();
  d.steps.push_back({"fitted", {}, current.train, d.base_held_out});
  const std::vector<PreparedRun> all = data.all();
  d.where = residual_maps(all, d.base);
  if (current.held_out.error() > options.curves_from) d.missing_base = missing_curves(data.train, d.base);

  // Two that shape the same edges: of a filter with two poles, a lag leaves what a delay takes away. Another effect is
  // one that removes a material share of what was there before both.
  std::map<std::size_t, Loss> before;  // each effect was added
  const auto mends_another = [&](std::size_t effect, const std::vector<std::size_t>& others, const Loss& without,
                                 const Loss& with) {
    const auto kin = kin_of(effect, others, model);
    if (!kin) return false;
    const auto own = before.find(effect);
    const Loss& both =
        own != before.end() && own->second.error() > before.at(*kin).error() ? own->second : before.at(*kin);
    return !takes_share(both, rule.edge_share, without, with, rule);
  };

  // Forward: add what removes most, until nothing material is left to remove.
  std::vector<std::size_t> found;
  while (found.size() < options.longest_list) {
    progress(0.1 + 0.15 * static_cast<double>(found.size()), "scoring absent effects");
    const Round& round = *search.round(found, [&] { return current; });
    std::vector<std::pair<Score, Trial>> trials = round.refits;
    for (const Score& s : round.scores) remember(d.candidates, s, {});
    for (const auto& [s, trial] : trials) remember(d.candidates, s, trial.held_out.error());
    std::erase_if(trials, [&](const auto& t) {
      return mends_another(t.first.effect, found, current.held_out, t.second.held_out) ||
             !shows_itself(model.about(t.first.effect), current.held_out, t.second.held_out);
    });
    std::optional<Trial> kept;
    const auto best_that_stays = [&] {
      const auto* best = best_of(trials, current, rule);
      while (best != nullptr) {
        if (search.determined(best->second.model, best->first.effect)) {
          kept = search.fit_from_elsewhere_too(best->second.model, model);
          if (kept && material(current.held_out, kept->held_out, rule))
            break;  // not only where a descent was broken off
        }
        std::erase_if(trials, [effect = best->first.effect](const auto& t) { return t.first.effect == effect; });
        best = best_of(trials, current, rule);
      }
      return best;
    };
    const auto* best = best_that_stays();
    if (best == nullptr) {
      if (auto teeth = search.whole_orders(round)) {
        remember(d.candidates, teeth->first, teeth->second.held_out.error());
        trials.push_back(std::move(*teeth));
        best = best_that_stays();
      }
    }
    if (best == nullptr) {
      auto two = search.two_at_once(round, found, rule);
      if (!two) break;
      for (const std::size_t effect : two->effects) {
        found.push_back(effect);
        before.insert_or_assign(effect, current.held_out);
        d.steps.push_back({"added " + id(effect), effect, two->trial.train, two->trial.held_out.error()});
      }
      current = std::move(two->trial);
      continue;
    }
    found.push_back(best->first.effect);
    before.insert_or_assign(found.back(), current.held_out);
    current = std::move(*kept);
    remember(d.candidates, best->first, current.held_out.error());
    d.steps.push_back({"added " + id(found.back()), found.back(), current.train, current.held_out.error()});
  }

  // Teeth: friction comes near enough to be taken first. Only where they explain most runs: a wave does a little of
  // anything. Where nothing was found, they were tried in that very round.
  if (!found.empty() && remainder(current.held_out, rule) && !current.model.about(found.front()).is_detent()) {
    progress(0.55, "trying teeth");
    auto teeth = search.teeth_first(*search.round({}, [&] { return current; }), found.size() + 1);
    if (teeth && search.explains_most_runs(teeth->trial) && material(current.held_out, teeth->trial.held_out, rule)) {
      current = std::move(teeth->trial);
      before = std::move(teeth->before);
      found = std::move(teeth->effects);
      for (const std::size_t effect : found) {
        d.steps.push_back({"added " + id(effect) + " instead", effect, current.train, current.held_out.error()});
      }
    }
  }

  // Fewer: what took three or more may be two that the first step passed by.
  if (found.size() >= 3) {
    progress(0.55, "trying fewer");
    if (auto two = search.fewer(*search.round({}, [&] { return current; }), current, found.front())) {
      const Loss first = before.at(found.front());
      found.assign(two->effects.begin(), two->effects.end());
      for (const std::size_t effect : found) before.insert_or_assign(effect, first);
      d.steps.push_back(
          {id(found[0]) + " and " + id(found[1]) + " instead", {}, two->trial.train, two->trial.held_out.error()});
      current = std::move(two->trial);
    }
  }

  // Swap: does another effect do as well in the place of a member, or better?
  std::map<std::size_t, std::vector<std::pair<std::size_t, Model>>> rivals;  // of each member
  for (std::size_t i = 0; i < found.size(); ++i) {
    progress(0.6 + 0.2 * static_cast<double>(i) / static_cast<double>(found.size()), "trying rivals");
    const std::size_t member = found[i];
    if (needed(member, current.model)) continue;
    std::vector<std::size_t> others = found;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    const Round* reduced = search.round(others, [&] {
      Model without = current.model;
      without.exclude(member);
      return search.try_fit(without, search.known_for(member, current));
    });
    if (reduced == nullptr) continue;
    for (const auto& [s, trial] : reduced->refits) {
      if (s.effect == member || !material(reduced->fitted.held_out, trial.held_out, rule)) continue;
      if (!search.determined(trial.model, s.effect)) continue;
      if (trial.held_out.error() < current.held_out.error() && !tied(trial.held_out, current.held_out, rule)) {
        d.steps.push_back(
            {"swapped " + id(member) + " for " + id(s.effect), s.effect, trial.train, trial.held_out.error()});
        current = trial;
        found[i] = s.effect;
        before.insert_or_assign(s.effect, before.at(member));
        rivals.erase(member);
      } else if (tied(current.held_out, trial.held_out, rule)) {
        rivals[found[i]].emplace_back(s.effect, trial.model);
      }
      remember(d.candidates, s, trial.held_out.error());
    }
  }

  // Prune: what the others have made superfluous goes.
  for (std::size_t i = 0; i < found.size() && found.size() > 1;) {
    progress(0.85, "pruning");
    if (needed(found[i], current.model)) {
      ++i;
      continue;
    }
    const auto fitted_without = [&](std::size_t effect) {
      Model without = current.model;
      without.exclude(effect);
      return search.try_fit(without, search.known_for(effect, current));
    };
    std::optional<Trial> reduced = fitted_without(found[i]);
    const auto worse_without = [&] { return !reduced || material(reduced->held_out, current.held_out, rule); };
    bool stays = worse_without();
    if (stays && reduced && !search.determined(current.model, found[i])) {  // a fit without it may have lost its way
      if (auto again = search.fit_from_elsewhere_too(reduced->model, model)) reduced = std::move(again);
      stays = worse_without();
    }
    if (stays && reduced && mends_another(found[i], found, reduced->held_out, current.held_out)) {
      // The lesser of the two goes.
      const auto other = fitted_without(*kin_of(found[i], found, model));
      stays = other && other->held_out.error() < reduced->held_out.error();
    }
    if (stays) {
      ++i;
      continue;
    }
    d.steps.push_back({"dropped " + id(found[i]), {}, reduced->train, reduced->held_out.error()});
    current = std::move(*reduced);
    rivals.erase(found[i]);
    found.erase(found.begin() + static_cast<std::ptrdiff_t>(i));
  }

  progress(0.9, "standard errors");
  const Calibration last = Search::calibrated(
      data.train, current.model, {.extra_starts = 0, .max_iterations = 40, .tolerance = 1e-8, .with_covariance = true});
  d.final = last.model;
  d.undetermined = last.identifiability.undetermined;
  d.final_train = current.train;
  d.final_held_out = current.held_out.error();
  d.base = search.judged(d.base);
  d.where_final = residual_maps(all, d.final);
  if (!d.missing_base.empty()) d.missing_final = missing_curves(data.train, d.final);
  d.signals = fit_of(data.held_out.empty() ? data.train : data.held_out, d.final, data.noise);

  for (const std::size_t effect : found) {
    MissingEffect m{effect, {}, {}};
    std::vector<Model> rival_models;
    for (const auto& [rival, fitted] : rivals[effect]) {
      if (std::ranges::find(found, rival) != found.end()) continue;  // a member itself: both are needed
      m.tied_with.push_back(rival);
      rival_models.push_back(fitted);
    }
    if (d.next.empty() && !rival_models.empty())
      d.next = next_experiments(train, data, d.final, rival_models, options.reach);
    m.parameters = d.final.parameters_of(effect);
    d.missing.push_back(std::move(m));
  }
  std::ranges::stable_sort(d.candidates, [](const Candidate& a, const Candidate& b) {
    const double unfit = 1e300;
    return std::pair(a.held_out_error.value_or(unfit), -a.score.predicted_drop) <
           std::pair(b.held_out_error.value_or(unfit), -b.score.predicted_drop);
  });

  if (!informative(data)) {
    d.verdict = Verdict::cannot_tell;
  } else if (remainder(current.held_out, rule)) {
    d.verdict = Verdict::unknown_effect;
  } else if (std::ranges::any_of(d.missing, [](const MissingEffect& m) { return !m.tied_with.empty(); })) {
    d.verdict = Verdict::tied;
  } else {
    d.verdict = d.missing.empty() ? Verdict::nothing_missing : Verdict::found;
  }
  progress(1, "done");
  return d;
}

}  // namespace emtb
