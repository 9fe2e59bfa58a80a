#include "analysis/diagnose/diagnose.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>

#include "analysis/diagnose/bench_parts.h"
#include "analysis/diagnose/explained_floor.h"
#include "analysis/diagnose/fitted_trials.h"
#include "analysis/diagnose/left_floor.h"
#include "analysis/diagnose/load_law.h"
#include "analysis/diagnose/moves.h"
#include "analysis/diagnose/plausibility.h"
#include "analysis/diagnose/remainder.h"
#include "analysis/diagnose/roads.h"
#include "analysis/diagnose/tied_values.h"
#include "analysis/diagnose/told_names.h"
#include "analysis/diagnose/whole_search.h"
#include "analysis/fit/logging_errors.h"
#include "hal/error.h"

namespace emtb {
namespace {

/// Did anything move at all? Readings that never leave their noise inform nothing.
bool informative(const Dataset& data) {
  constexpr double moves = 1.5;  // floors, over thousands of readings
  for (const Record& record : data.train) {
    for (const Observation& o : record.observations) {
      if (o.signal != Signal::omega && o.signal != Signal::i_a) continue;
      double mean = 0, squares = 0;
      for (const double v : o.value) mean += v / static_cast<double>(o.size());
      for (const double v : o.value) squares += (v - mean) * (v - mean);
      if (std::sqrt(squares / static_cast<double>(o.size())) > moves * data.noise.at(o.signal).sigma) return true;
    }
  }
  return false;
}

/// Which runs judge, and how.
void say_what_judges(Diagnosis& d, std::span<const Run> train, std::span<const Run> held_out) {
  d.left_one_out = held_out.empty() && train.size() > 1;
  d.judged_on_training = held_out.empty() && train.size() == 1;
}

/// What the search found, with standard errors, and what of it is left.
/// @param last it, fitted to the end; none where it has no fit
void tell_the_answer(Diagnosis& d, const Dataset& data, const RecordRefs& all, const Finding& found,
                     std::optional<Calibration> last, const Model& given) {
  d.final = found.current.model();
  if (last) {
    d.final = std::move(last->model);
    d.at_bound = std::move(last->at_bound);
    d.undetermined = std::move(last->identifiability.undetermined);
  }
  d.pins = pins_of(data.train, d.final);
  widen_by_held_damping(data.train, given, d.final);
  d.final_train = found.current.train;
  d.final_held_out = found.current.held_out_error();
  CalibrationOptions as_it_is{.extra_starts = 0, .max_iterations = 0};
  try {
    Calibration base = calibrate(data.train, d.base, as_it_is);
    widen_by_logging(data.train, base);
    d.base = base.model;
  } catch (const ModelError&) {  // it stays without errors
  }
  widen_by_held_damping(data.train, given, d.base);
  d.where_final = residual_maps(all, d.final);
  if (!d.missing_base.empty()) d.missing_final = missing_curves(data.train, d.final);
  d.signals = fit_of(data.held_out.empty() ? data.train : data.held_out, d.final, data.noise);
}

/// How many steps a search may simulate at an effort (DiagnoseOptions): some minutes of two cores at 1, less where few
/// readings leave little to look for.
std::uint64_t most_steps(const Dataset& data, const Model& model, double effort) {
  // By hand: slow right answers took up to 4e8, of 460 rows that no one effect explains between 3e7 and 3e8. Of few
  // rows, each of many steps, no more was measured than that a search has an end.
  constexpr double steps = 1e9, passes = 2000, passes_of_few_rows = 20000, for_each_row = 1e6;
  double once = 0, rows = 0;
  for (const Record& record : data.train) {
    once += static_cast<double>(steps_of(record.structure(model), record.excitation));
    rows += static_cast<double>(record.excitation.t.size());
  }
  const double of_few = std::max(passes_of_few_rows * once, for_each_row * rows);
  return static_cast<std::uint64_t>(effort * std::max(passes * once, std::min(steps, of_few)));
}

bool named(const Finding& found, std::size_t effect) {
  return std::ranges::find(found.effects, effect) != found.effects.end();
}

/// Is an effect there for the sake of another that needs it, and does nothing itself?
bool is_only_needed(std::size_t effect, const Model& model) {
  return needed(effect, model) && !has_size(effect, model);
}

/// Names what was found, with what is tied with it, and what would tell them apart.
void name_the_missing(Diagnosis& d, const Finding& found, std::span<const Run> train, const Dataset& data,
                      const Reach& reach) {
  std::vector<Model> all_rivals;
  for (const std::size_t effect : found.effects) {
    if (is_only_needed(effect, d.final)) continue;
    MissingEffect m{effect, {}, {}};
    std::vector<Model> rival_models;
    const auto rivals = found.rivals.find(effect);
    for (const Rival& rival : rivals != found.rivals.end() ? rivals->second : std::vector<Rival>{}) {
      if (named(found, rival.effect)) continue;  // a member: both are needed
      m.tied_with.push_back(rival.effect);
      rival_models.push_back(rival.model);
      for (OtherValue& other : values_that_differ(d.final, rival.model, rival.effect))
        m.otherwise.push_back(std::move(other));
    }
    all_rivals.insert(all_rivals.end(), rival_models.begin(), rival_models.end());
    if (d.next.empty() && !rival_models.empty()) {
      d.next = next_experiments(train, data, d.final, rival_models, reach);
    }
    d.missing.push_back(std::move(m));
  }
  widen_by_ties(all_rivals, d.final);
  for (MissingEffect& m : d.missing) m.parameters = d.final.parameters_of(m.effect);
}

void say_why_refused(Finding& found, const FittedTrials& trials) {
  for (const auto& [effect, why] : trials.refused()) {
    const auto candidate =
        std::ranges::find(found.candidates, effect, [](const Candidate& c) { return c.score.effect; });
    if (candidate != found.candidates.end() && !named(found, effect)) candidate->implausible = why;
  }
}

/// No size that an effect cannot have would have shown.
void tell_sizes_that_may_be(Finding& found, const FittedMachine& machine) {
  for (Candidate& c : found.candidates) {
    double& size = c.score.detectable_size;
    if (c.score.effect >= effect_count || c.score.starts.empty() || !std::isfinite(size) || size <= 0) continue;
    std::vector<double> values = c.score.starts.front().from;
    values.front() = size;
    if (!implausible(c.score.effect, values, machine).empty()) size = infinity;
  }
}

void sort_best_first(std::vector<Candidate>& candidates) {
  std::ranges::stable_sort(candidates, [](const Candidate& a, const Candidate& b) {
    const double unfit = 1e300;  // any that was not refitted comes after those that were
    return std::pair(a.held_out_error.value_or(unfit), -a.score.predicted_drop) <
           std::pair(b.held_out_error.value_or(unfit), -b.score.predicted_drop);
  });
}

/// The model as given, once fitted, and where it fails.
void tell_of_the_base(Diagnosis& d, const Dataset& data, const RecordRefs& all, const Trial& first,
                      const DiagnoseOptions& options) {
  d.base = first.model();
  d.base_train = first.train;
  d.base_held_out = first.held_out_error();
  d.where = residual_maps(all, d.base);
  if (d.base_held_out > options.curves_from) d.missing_base = missing_curves(data.train, d.base);
}

/// The first fit. What the data cannot tell is pinned in it, and so in all that follow.
Trial first_fit(FittedTrials& trials, const Dataset& data, const Model& given) {
  Trial first = trials.first_fit(given);
  const std::vector<std::size_t> places = places_to_hold(data.train, first.model());
  if (places.empty()) return first;
  return trials.first_fit(hold(data.train, given, first.model(), places));
}

/// A simulation that blows up where it is to judge tells nothing, least of all that nothing is missing.
void refuse_what_leaves_all_bounds(const Trial& answer) {
  if (!answer.held_out.leaves_all_bounds()) return;
  throw ModelError(
      "model `" + answer.model().name +
      "`, fitted to the training runs, leaves all bounds on a held-out run, which therefore judges nothing. "
      "Add sessions like it to the training, or leave out the effect that grows so fast");
}

/// Does what was found leave the same in other steps? It is then fitted in them, and nothing needs to be searched.
bool stands_in_other_steps(Road& road, WholeSearch& search, const Criterion& criterion) {
  Trial& found = road.found.current;
  Trial again = search.again(found);
  if (criterion.material(found.held_out, again.held_out) || criterion.material(again.held_out, found.held_out))
    return false;
  found = std::move(again);
  road.first = search.again(road.first);
  return true;
}

/// Of a search that was cut as well.
/// @param steps that it had
void tell_the_tied(Road& road, WholeSearch& search, std::uint64_t steps) {
  constexpr std::uint64_t share = 5;
  search.trials().go_on_by(steps / share);
  road.found = search.with_rivals_renewed(std::move(road.found), road.first.held_out);
}

Verdict verdict_of(const Diagnosis& d, const Dataset& data, bool remainder) {
  if (!informative(data)) return Verdict::cannot_tell;
  if (remainder) return Verdict::unknown_effect;
  if (std::ranges::any_of(d.missing, [](const MissingEffect& m) { return !m.tied_with.empty(); })) return Verdict::tied;
  return d.missing.empty() ? Verdict::nothing_missing : Verdict::found;
}

void say_which_runs_show_it(Diagnosis& d, const FittedTrials& trials, const Road& road) {
  d.shown_by = trials.runs_that_alone_show_a_remainder(road.found.current);
  d.shown_at_first = trials.runs_that_alone_show_a_remainder(road.first);
}

Diagnosis diagnose_as_named(std::span<const Run> train, std::span<const Run> held_out, const Model& model,
                            const DiagnoseOptions& options);

}  // namespace

bool Diagnosis::only_training_shows_it() const {
  constexpr double hardly = 0.95;  // times as much: a twentieth of an error is not worth a name
  return training_judges && final_train < hardly * base_train && final_held_out >= hardly * base_held_out;
}

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

namespace {

/// Runs that were named, of which some held-out ones are fitted as well.
struct Fitted {
  std::vector<Run> train, held_out;
  std::vector<std::string> too;

  /// @return whether it was held out until now
  bool take(const std::string& name) {
    const auto run = std::ranges::find(held_out, name, &Run::name);
    if (run == held_out.end()) return false;
    too.push_back(run->name);
    train.push_back(std::move(*run));
    held_out.erase(run);
    return true;
  }
};

/// Does an answer for the same runs, of which one more was fitted, leave clearly less, or give all a name?
bool explains_more(const Diagnosis& with, const Diagnosis& without) {
  constexpr double clearly = 0.75;  // times as much
  const auto left = [](const Diagnosis& d) { return std::max(d.final_train, d.final_held_out); };
  return left(with) < clearly * left(without) || with.verdict == Verdict::found || with.verdict == Verdict::tied;
}

}  // namespace

Diagnosis diagnose(std::span<const Run> train, std::span<const Run> held_out, const Model& model,
                   const DiagnoseOptions& options) {
  Diagnosis d = diagnose_as_named(train, held_out, model, options);
  if (options.keep_held_out || (d.shown_by.empty() && d.shown_at_first.empty())) return d;
  const auto time_is_up = [&] { return options.ends_now && options.ends_now(); };
  Fitted runs{{train.begin(), train.end()}, {held_out.begin(), held_out.end()}, {}};
  if (d.shown_by.empty() && d.verdict == Verdict::unknown_effect && !time_is_up() &&
      runs.take(d.shown_at_first.front())) {
    // What no training run shows cannot be told from what they leave: it may have bent what was found.
    Diagnosis with = diagnose_as_named(runs.train, runs.held_out, model, options);
    if (time_is_up() || !explains_more(with, d)) return d;
    d = std::move(with);
  }
  while (!d.shown_by.empty() && !time_is_up() && runs.take(d.shown_by.front())) {
    d = diagnose_as_named(runs.train, runs.held_out, model, options);
  }
  d.fitted_too = std::move(runs.too);
  return d;
}

namespace {

Diagnosis diagnose_as_named(std::span<const Run> train, std::span<const Run> held_out, const Model& model,
                            const DiagnoseOptions& options) {
  const auto progress = [&](double share, const std::string& doing) {
    if (options.progress) options.progress(share, doing);
  };
  const auto prepared = std::make_shared<Dataset>(prepare(train, held_out, model));
  const Dataset& data = *prepared;
  const bool only_loads = !options.explain_torque && torque_only_loads(data.train, model);
  const MaterialityCriterion criterion(options.materiality, only_loads);
  Diagnosis d;
  d.data = prepared;
  say_what_judges(d, train, held_out);

  progress(0.02, "fitting the model as given");
  d.withheld = withheld_effects(model, data.train);
  Model given = without_pins(model);
  given.withheld.clear();
  for (const Withheld& w : d.withheld) given.withheld.push_back(w.effect);
  FittedTrials trials(data, given, criterion, options.score, options.refits);
  const std::uint64_t most = most_steps(data, model, options.effort);
  trials.bound_by(most, options.ends_now);
  Trial first = first_fit(trials, data, given);
  if (set_steps(*prepared, first.model())) first = first_fit(trials, data, given);
  if (auto quieter = floors_down_to_what_is_left(data, first.model())) {
    set_noise(*prepared, std::move(*quieter), given);
    first = first_fit(trials, data, given);
  }
  WholeSearch search(*prepared, trials, criterion, {options.longest_list, only_loads}, progress);
  const Circumstances recorded = circumstances_of(data);
  Road road = best_road(*prepared, search, criterion, first);
  const auto road_anew = [&] { return best_road(*prepared, search, criterion, first_fit(trials, data, given)); };
  if (!trials.exhausted() && set_shorter_steps(*prepared, road.found.current.model()) &&
      !stands_in_other_steps(road, search, criterion))
    road = road_anew();
  if (auto quieter =
          trials.exhausted() ? std::nullopt : floors_down_to_what_is_left(data, road.found.current.model())) {
    set_noise(*prepared, std::move(*quieter), given);
    road = road_anew();
  }
  const bool has_other_runs = !held_out.empty() || train.size() > 1;
  if (has_other_runs && !trials.exhausted() && !criterion.remainder(road.found.current.held_out)) {
    if (auto quieter = floors_without_a_law(trials, data.noise, road.found.current)) {
      set_noise(*prepared, std::move(*quieter), given);
      road = road_anew();
    }
  }
  refuse_what_leaves_all_bounds(road.found.current);
  progress(0.9, "standard errors");
  const std::vector<Signal> inputs = only_loads ? std::vector{Signal::torque} : std::vector<Signal>{};
  const auto without = [&](std::span<const std::size_t> effects) {
    given.withheld.insert(given.withheld.end(), effects.begin(), effects.end());
    set(*prepared, recorded);
    return road_anew();
  };
  std::optional<Calibration> last =
      keep_what_is_told(road, without, search, criterion, *prepared, {inputs, options.materiality});
  if (trials.exhausted()) tell_the_tied(road, search, most);
  Finding& found = road.found;
  d.training_judges = trials.training_judges();
  d.cut = trials.cut();
  d.torque_only_loads = only_loads;
  d.torque_is_input = search.torque_left_out();
  const RecordRefs all = data.all();
  tell_of_the_base(d, data, all, road.first, options);
  tell_the_answer(d, data, all, found, std::move(last), model);
  name_the_missing(d, found, train, data, options.reach);
  say_why_refused(found, trials);
  tell_sizes_that_may_be(found, machine_of(data.train, d.final));
  sort_best_first(found.candidates);
  const Loss& left = found.current.held_out;
  const bool is_refused_law = leaves_a_share(left, inputs, options.materiality) &&
                              is_of_a_refused_law(found.candidates, found.current.held_out_error());
  d.verdict = verdict_of(d, data, is_refused_law || worth_a_name(data, d.final, left, inputs, options.materiality));
  if (d.verdict == Verdict::unknown_effect) say_which_runs_show_it(d, trials, road);
  d.candidates = std::move(found.candidates);
  d.steps = found.steps_to_the_end();
  progress(1, "done");
  return d;
}

}  // namespace
}  // namespace emtb
