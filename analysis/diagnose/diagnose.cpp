#include "analysis/diagnose/diagnose.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>

#include "analysis/diagnose/bench_parts.h"
#include "analysis/diagnose/fitted_trials.h"
#include "analysis/diagnose/load_law.h"
#include "analysis/diagnose/moves.h"
#include "analysis/diagnose/remainder.h"
#include "analysis/fit/starts.h"
#include "analysis/fit/timing.h"
#include "analysis/fit/timing_errors.h"
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

/// A model fitted to the end, with all that is known of its errors.
Calibration with_all_errors(const Dataset& data, const Model& model) {
  CalibrationOptions careful{.extra_starts = 0, .max_iterations = 40, .tolerance = 1e-8, .with_covariance = true};
  Calibration last = calibrate(data.train, model, careful);
  widen_by_timing(data.train, last);
  return last;
}

bool told_by_all_errors(const Dataset& data, const Model& model, std::size_t effect) {
  try {
    return told_from_zero(with_all_errors(data, model), effect);
  } catch (const ModelError&) {
    return true;  // nothing is known of them
  }
}

/// A search judges by quick errors. What the errors that are printed do not tell from nothing goes, the last found
/// first; but not where most of what has no other name would be left without it, when timing and starts have had their
/// say.
void drop_what_is_not_told(Finding& found, FittedTrials& trials, const Criterion& criterion, Dataset& data) {
  for (std::size_t left = found.effects.size(); left > 0; --left) {
    const std::size_t effect = found.effects[left - 1];
    if (needed(effect, found.current.model())) continue;
    if (told_by_all_errors(data, found.current.model(), effect)) continue;
    Model without = found.current.model();
    without.exclude(effect);
    std::optional<Trial> trial = trials.fit_from_elsewhere_too(without);
    const Timing before = data.timing;
    if (trial && settle_timing(data, trial->model()) != TimingChange::none)
      trial = trials.fit_to_the_end(trial->model());
    const bool is_needed =
        !trial || (criterion.remainder(trial->held_out) && removes_most(trial->held_out, found.current.held_out));
    if (is_needed) {
      set_timing(data, before);
      continue;
    }
    found.current = std::move(*trial);
    found.effects.erase(found.effects.begin() + static_cast<std::ptrdiff_t>(left - 1));
    found.rivals.erase(effect);
    found.steps.push_back({"dropped " + std::string(without.about(effect).id) + ": within its own errors",
                           {},
                           found.current.train,
                           found.current.held_out.error()});
  }
}

/// What the search found, fitted to the end with standard errors, and what of it is left.
void fit_the_answer(Diagnosis& d, const Dataset& data, std::span<const Record> all, const Finding& found,
                    const Model& given) {
  try {
    const Calibration last = with_all_errors(data, found.current.model());
    d.final = last.model;
    d.at_bound = last.at_bound;
    d.undetermined = last.identifiability.undetermined;
  } catch (const ModelError&) {
    d.final = found.current.model();
  }
  d.pins = pins_of(data.train, d.final);
  widen_by_held_damping(data.train, given, d.final);
  d.final_train = found.current.train;
  d.final_held_out = found.current.held_out.error();
  CalibrationOptions as_it_is{.extra_starts = 0, .max_iterations = 0};
  try {
    Calibration base = calibrate(data.train, d.base, as_it_is);
    widen_by_timing(data.train, base);
    d.base = base.model;
  } catch (const ModelError&) {  // it stays without errors
  }
  widen_by_held_damping(data.train, given, d.base);
  d.where_final = residual_maps(all, d.final);
  if (!d.missing_base.empty()) d.missing_final = missing_curves(data.train, d.final);
  d.signals = fit_of(data.held_out.empty() ? data.train : data.held_out, d.final, data.noise);
}

bool named(const Finding& found, std::size_t effect) {
  return std::ranges::find(found.effects, effect) != found.effects.end();
}

/// Names what was found, with what is tied with it, and what would tell them apart.
void name_the_missing(Diagnosis& d, const Finding& found, std::span<const Run> train, const Dataset& data,
                      const Reach& reach) {
  for (const std::size_t effect : found.effects) {
    MissingEffect m{effect, {}, {}};
    std::vector<Model> rival_models;
    const auto rivals = found.rivals.find(effect);
    for (const Rival& rival : rivals != found.rivals.end() ? rivals->second : std::vector<Rival>{}) {
      if (named(found, rival.effect)) continue;  // a member: both are needed
      m.tied_with.push_back(rival.effect);
      rival_models.push_back(rival.model);
    }
    if (d.next.empty() && !rival_models.empty()) {
      d.next = next_experiments(train, data, d.final, rival_models, reach);
    }
    m.parameters = d.final.parameters_of(effect);
    d.missing.push_back(std::move(m));
  }
}

void sort_best_first(std::vector<Candidate>& candidates) {
  std::ranges::stable_sort(candidates, [](const Candidate& a, const Candidate& b) {
    const double unfit = 1e300;  // any that was not refitted comes after those that were
    return std::pair(a.held_out_error.value_or(unfit), -a.score.predicted_drop) <
           std::pair(b.held_out_error.value_or(unfit), -b.score.predicted_drop);
  });
}

/// The search. A measured torque of which the model as given says nothing has its law asked first; where it has none
/// it is an input, and from there on no model is compared with it.
class WholeSearch {
 public:
  WholeSearch(Dataset& data, FittedTrials& trials, const Criterion& criterion, const Model& given,
              const DiagnoseOptions& options, Search::Progress progress)
      : data_(data), trials_(trials), criterion_(criterion), options_(options), progress_(std::move(progress)) {
    const bool has_a_load = std::ranges::any_of(
        given.effects, [&](const IncludedEffect& e) { return concerns_the_load(given.about(e.effect)); });
    only_drives_ = !options.explain_torque && !has_a_load && torque_loads_the_shaft(data);
  }

  /// @param first the model as given, once fitted; fitted again where the torque is left out
  Finding from(Trial& first) {
    if (!only_drives_) return search_and_settle(first);
    if (torque_left_out_) return search(without_effects_of_the_load(first));
    std::optional<Finding> law = law_beside(first.model(), first);
    if (!law) {
      Readings torque = leave_out(data_, is_torque);
      const Trial without_torque = again(first);
      Finding motion = search(without_effects_of_the_load(without_torque));
      put_back(data_, std::move(torque));
      // At rest a brake holds what friction leaves of the motor's torque.
      if (!motion.effects.empty()) law = law_beside(motion.current.model(), first);
      if (!law) {
        leave_out(data_, is_torque);
        torque_left_out_ = true;
        first = without_torque;
        return motion;
      }
    }
    Finding found = search(without_effects_of_the_load(law->current), first.held_out);
    return with_law(std::move(*law), std::move(found));
  }

  /// What was found, in data whose timing has changed slightly: without what stood in for that.
  Finding again(Finding found, const Loss& as_given) {
    return Search(trials_, criterion_, std::move(found), as_given, progress_).without_superfluous();
  }

  /// In data whose timing or starts have changed: what was found before, where it leaves nothing and no other effect
  /// does as well in the place of one of it; otherwise a search anew, unless what was found still does better.
  Finding anew_from(Trial& first, Finding before) {
    const std::vector<std::size_t> effects = before.effects;
    Finding kept = Search(trials_, criterion_, std::move(before), first.held_out, progress_).held_against_others();
    if (kept.effects == effects && !criterion_.anything_left(kept.current.held_out)) return kept;
    Finding anew = from(first);
    if (criterion_.material(anew.current.held_out, kept.current.held_out)) return kept;
    return anew;
  }

  /// The same model, fitted to data that have changed.
  Trial again(const Trial& fitted) { return trials_.fit(fitted.model(), nullptr).value_or(fitted); }

  /// What a search asks once it has found an effect that removes most: do the runs tell another timing or other starts
  /// beside it? It gives the model as given, fitted to what has changed, and the search begins anew from there.
  using Resettle = std::function<std::optional<Trial>(const Model& with_the_effect)>;
  void set_resettle(Resettle resettle) { resettle_ = std::move(resettle); }

  bool torque_only_loads() const { return only_drives_; }
  bool torque_left_out() const { return torque_left_out_; }

 private:
  Finding search(const Trial& start, const Loss& as_given) {
    return Search(trials_, criterion_, start, as_given, options_.longest_list, progress_).run();
  }

  Finding search_and_settle(const Trial& first) {
    Search search(trials_, criterion_, first, first.held_out, options_.longest_list, progress_);
    const Trial* with_an_effect = resettle_ ? search.first_step() : nullptr;
    const std::optional<Trial> anew = with_an_effect ? resettle_(with_an_effect->model()) : std::nullopt;
    return anew ? this->search(*anew) : search.run();
  }

  Finding search(const Trial& start) { return search(start, start.held_out); }

  static bool is_torque(Signal signal) { return signal == Signal::torque; }

  /// The law of the measured torque, from its reading alone, with a model held fast; put on the first one.
  std::optional<Finding> law_beside(const Model& fitted, const Trial& first) {
    Readings others = leave_out(data_, std::not_fn(is_torque));
    const std::optional<Trial> start = trials_.fit(with_only_the_load_open(fitted, first.model()), nullptr);
    std::optional<Finding> law;
    if (start) law = search(*start);
    put_back(data_, std::move(others));
    if (!law || law->effects.empty() || !follows_the_torque(start->held_out, law->current.held_out))
      return std::nullopt;
    return put_on(*law, first, trials_, criterion_);
  }

  Dataset& data_;
  FittedTrials& trials_;
  const Criterion& criterion_;
  const DiagnoseOptions& options_;
  Search::Progress progress_;
  Resettle resettle_;
  bool only_drives_ = false, torque_left_out_ = false;
};

/// How the runs were logged and begin, as it is set.
struct Circumstances {
  Timing timing;
  std::vector<InitialState> starts;
};

Circumstances circumstances_of(const Dataset& data) {
  Circumstances as_set{data.timing, {}};
  for (const auto* records : {&data.train, &data.held_out}) {
    for (const Record& record : *records) as_set.starts.push_back(record.excitation.initial);
  }
  return as_set;
}

void set(Dataset& data, const Circumstances& circumstances) {
  set_timing(data, circumstances.timing);
  auto start = circumstances.starts.begin();
  for (auto* records : {&data.train, &data.held_out}) {
    for (Record& record : *records) record.excitation.initial = *start++;
  }
}

/// The model as given, and what a search found from there, under the same circumstances.
struct Road {
  Trial first;
  Finding found;
  Circumstances circumstances;
};

/// A search at the timing and the starts that are set, and once more where its answer tells others: what the model
/// lacked may have looked like another timing, or another start. The first answer stands where it still does better. By
/// how little an instrument is behind the others only the answer tells.
Road search_from(Dataset& data, WholeSearch& search, Trial first) {
  // Starts bend the fit and the fit the starts.
  for (int again = 0; again < 3 && settle_starts(data, first.model()); ++again) {
    first = search.again(first);
  }
  search.set_resettle([&](const Model& with_the_effect) -> std::optional<Trial> {
    const Circumstances before = circumstances_of(data);
    const bool other_starts = settle_starts(data, with_the_effect);
    if (settle_timing(data, with_the_effect) != TimingChange::other && !other_starts) {
      set(data, before);
      return std::nullopt;
    }
    first = search.again(first);
    return first;
  });
  Finding found = search.from(first);
  search.set_resettle({});
  const bool other_starts = settle_starts(data, found.current.model());
  TimingChange change = settle_timing(data, found.current.model());
  if (change == TimingChange::other || other_starts) {
    first = search.again(first);
    found = search.anew_from(first, std::move(found));
    change = settle_timing(data, found.current.model());
  }
  if (change != TimingChange::none) {
    first = search.again(first);
    found = search.again(std::move(found), first.held_out);
  }
  return {std::move(first), std::move(found), circumstances_of(data)};
}

/// The timing that a model tells which lacks something may be what it lacks, and so hide it: the runs are searched as
/// they were recorded, too, where something is left; that answer stands where it leaves clearly less. What it finds to
/// be late by less than a row is then no matter of logging.
Road best_road(Dataset& data, WholeSearch& search, const Criterion& criterion, const Trial& as_recorded) {
  const Circumstances recorded = circumstances_of(data);
  const TimingChange change = settle_timing(data, as_recorded.model());
  if (change == TimingChange::none) return search_from(data, search, as_recorded);
  if (change == TimingChange::slight) return search_from(data, search, search.again(as_recorded));
  Road told = search_from(data, search, search.again(as_recorded));
  if (!criterion.remainder(told.found.current.held_out)) return told;
  Circumstances in_itself = recorded;
  in_itself.timing.late_in_itself = true;
  set(data, in_itself);
  Road plain = search_from(data, search, search.again(as_recorded));
  Road& best = criterion.material(told.found.current.held_out, plain.found.current.held_out) ? plain : told;
  set(data, best.circumstances);
  return std::move(best);
}

/// The model as given, once fitted, and where it fails.
void tell_of_the_base(Diagnosis& d, const Dataset& data, std::span<const Record> all, const Trial& first,
                      const DiagnoseOptions& options) {
  d.base = first.model();
  d.base_train = first.train;
  d.base_held_out = first.held_out.error();
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

Verdict verdict_of(const Diagnosis& d, const Dataset& data, bool remainder) {
  if (!informative(data)) return Verdict::cannot_tell;
  if (remainder) return Verdict::unknown_effect;
  if (std::ranges::any_of(d.missing, [](const MissingEffect& m) { return !m.tied_with.empty(); })) return Verdict::tied;
  return d.missing.empty() ? Verdict::nothing_missing : Verdict::found;
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
  const auto progress = [&](double share, const std::string& doing) {
    if (options.progress) options.progress(share, doing);
  };
  const auto prepared = std::make_shared<Dataset>(prepare(train, held_out, model));
  const Dataset& data = *prepared;
  const MaterialityCriterion by_materiality(options.materiality);
  const Criterion& criterion = options.criterion ? *options.criterion : by_materiality;
  Diagnosis d;
  d.data = prepared;
  say_what_judges(d, train, held_out);

  progress(0.02, "fitting the model as given");
  d.withheld = withheld_effects(model, data.train);
  Model given = without_pins(model);
  given.withheld.clear();
  for (const Withheld& w : d.withheld) given.withheld.push_back(w.effect);
  FittedTrials trials(data, given, criterion, options.score, options.refits);
  Trial first = first_fit(trials, data, given);
  WholeSearch search(*prepared, trials, criterion, model, options, progress);
  Road road = best_road(*prepared, search, criterion, first);
  first = std::move(road.first);
  Finding found = std::move(road.found);
  if (auto freed = trials.with_told_pins_free(found.current)) found.current = std::move(*freed);
  drop_what_is_not_told(found, trials, criterion, *prepared);
  d.torque_only_loads = search.torque_only_loads();
  d.torque_is_input = search.torque_left_out();
  const std::vector<Record> all = data.all();
  tell_of_the_base(d, data, all, first, options);

  progress(0.9, "standard errors");
  fit_the_answer(d, data, all, found, model);
  name_the_missing(d, found, train, data, options.reach);
  for (const auto& [effect, why] : trials.refused()) {
    const auto candidate =
        std::ranges::find(found.candidates, effect, [](const Candidate& c) { return c.score.effect; });
    if (candidate != found.candidates.end() && !named(found, effect)) candidate->implausible = why;
  }
  sort_best_first(found.candidates);
  const std::vector<Signal> inputs = d.torque_only_loads ? std::vector{Signal::torque} : std::vector<Signal>{};
  d.verdict = verdict_of(d, data, worth_a_name(data, d.final, found.current.held_out, inputs, options.materiality));
  if (d.verdict == Verdict::unknown_effect) d.shown_by = trials.runs_that_alone_show_a_remainder(found.current);
  d.candidates = std::move(found.candidates);
  d.steps = std::move(found.steps);
  progress(1, "done");
  return d;
}

}  // namespace emtb
