#include "analysis/diagnose/told_names.h"

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "analysis/diagnose/fitted_trials.h"
#include "analysis/diagnose/moves.h"
#include "analysis/diagnose/remainder.h"
#include "analysis/fit/logging_errors.h"
#include "analysis/fit/timing.h"
#include "hal/error.h"

namespace emtb {
namespace {

/// A model fitted to the end, with all that is known of its errors; none where it has no fit.
std::optional<Calibration> with_all_errors(const Dataset& data, const Model& model) {
  CalibrationOptions careful{.extra_starts = 0, .max_iterations = 40, .tolerance = 1e-8, .with_covariance = true};
  try {
    Calibration last = calibrate(data.train, model, careful);
    widen_by_logging(data.train, last);
    return last;
  } catch (const ModelError&) {
    return std::nullopt;
  }
}

constexpr double by_far = 5;                             // errors
constexpr double much_likelier = 0.5 * by_far * by_far;  // [nats], the same for what is not linear

/// What is dropped for its errors.
struct Drops {
  std::map<std::size_t, double> costly;  ///< [nats] with which much likelihood went, and most of what it explained,
                                         ///< though it may be
  std::set<std::size_t> kept;            ///< is not dropped for them
};

/// A search judges by quick errors. What the errors that are printed do not tell from nothing by far goes, the last
/// found first: of the laws that were looked at, one is likely to be three from nothing, and what few pieces tell of an
/// error may be off by half. But not where much likelihood and a share that matters are lost with it, when timing and
/// starts have had their say, or most of what has no other name, and that is worth a name; unless it is hardly told at
/// all and leaves enough itself, or is nothing within one error. What fitted to the end has gone where it is not
/// what it is called goes as well. Nothing goes without which the rest foretells other runs worse than the model as
/// given: that is no answer, whatever its errors.
/// @return what is known of the errors of the rest
std::optional<Calibration> drop_what_is_not_told(Finding& found, const Loss& as_given, WholeSearch& search,
                                                 const Criterion& criterion, Dataset& data, const WorthAName& worth,
                                                 Drops& drops) {
  FittedTrials& trials = search.trials();
  constexpr double hardly = 2, not_at_all = 1;  // errors
  std::optional<Calibration> judged = with_all_errors(data, found.current.model());
  for (std::size_t left = found.effects.size(); judged && left > 0; --left) {
    const std::size_t effect = found.effects[left - 1];
    if (needed(effect, found.current.model()) || drops.kept.contains(effect)) continue;
    bool may_be = trials.determined_but_for_scale(judged->model, effect);
    if (may_be && told_from_zero(*judged, effect, by_far)) continue;
    const bool doubtful =
        criterion.remainder(found.current.held_out) && !told_but_for_scale(data.train, *judged, effect, hardly);
    Model without = found.current.model();
    without.exclude(effect);
    std::optional<Trial> trial = trials.fit_from_elsewhere_too(without);
    const Circumstances as_set = circumstances_of(data);
    Timing before = data.timing;
    if (trial && settle_timing(data, trial->model()) != TimingChange::none)
      trial = trials.fit_to_the_end(trial->model());
    if (trial && criterion.worth_a_wide_search(trial->held_out))
      told_from_the_recorded(data, search, criterion, *trial);
    if (trial && !may_be && !before.lags_in_itself && criterion.remainder(trial->held_out)) {
      // What lags by less than a row, and no timing has its shape, is the machine.
      const Timing without_it = data.timing;
      Timing in_itself = before;
      in_itself.lags_in_itself = true;
      set_timing(data, in_itself);
      may_be = trials.determined_but_for_scale(judged->model, effect);
      if (may_be) before = in_itself;
      set_timing(data, without_it);
    }
    const bool is_something = may_be && told_but_for_scale(data.train, *judged, effect, not_at_all);
    const bool is_needed = !trial || criterion.material(trial->held_out, as_given) ||
                           (is_something && criterion.remainder(trial->held_out) && !doubtful &&
                            ((leaves_a_share(trial->held_out, worth.inputs, worth.rule) &&
                              gain(*trial->held_out.quality, *found.current.held_out.quality) > much_likelier) ||
                             (removes_most(trial->held_out, found.current.held_out) &&
                              worth_a_name(data, trial->model(), trial->held_out, worth.inputs, worth.rule))));
    if (is_needed) {
      set(data, as_set);
      set_timing(data, before);
      continue;
    }
    const double lost = gain(*trial->held_out.quality, *found.current.held_out.quality);
    if (may_be && lost > much_likelier && removes_most(trial->held_out, found.current.held_out))
      drops.costly.insert_or_assign(effect, lost);
    found.current = std::move(*trial);
    found.effects.erase(found.effects.begin() + static_cast<std::ptrdiff_t>(left - 1));
    found.rivals.erase(effect);
    found.steps.push_back(
        {"dropped " + std::string(without.about(effect).id) + ": its own errors do not tell it from nothing",
         {},
         found.current.train,
         found.current.held_out_error()});
    judged = with_all_errors(data, found.current.model());
    left = found.effects.size() + 1;  // what was told beside it may not be without it
  }
  return judged;
}

/// The effects of one list that another lacks.
std::vector<std::size_t> gone(std::vector<std::size_t> before, const std::vector<std::size_t>& after) {
  std::erase_if(before, [&](std::size_t effect) { return std::ranges::find(after, effect) != after.end(); });
  return before;
}

/// What was found, in which something is left, and what more is found without some effects.
Finding gone_on_without(Finding found, std::span<const std::size_t> effects, WholeSearch& search,
                        const Loss& as_given) {
  std::vector<std::size_t>& withheld = found.current.fit.model.withheld;
  withheld.insert(withheld.end(), effects.begin(), effects.end());
  return search.gone_on(std::move(found), as_given);
}

/// What was tried before a search anew, and not in it, is told as well.
void remember(std::vector<Candidate>& candidates, const std::vector<Candidate>& before) {
  for (const Candidate& c : before) {
    const auto same = [&](const Candidate& other) { return other.score.effect == c.score.effect; };
    if (std::ranges::none_of(candidates, same)) candidates.push_back(c);
  }
}

/// The likeliest answer that was dropped from, and what it was found in.
struct Likeliest {
  Road road;
  Circumstances circumstances;
  bool training_judged = false;

  void consider(const Road& other, const Dataset& data, bool training_judges) {
    const bool comparable = training_judges == training_judged;
    if (!comparable || gain(*road.found.current.held_out.quality, *other.found.current.held_out.quality) <= 0) return;
    road = other;
    circumstances = circumstances_of(data);
  }
};

/// Drops, and goes on without.
std::optional<Calibration> keep_what_errors_tell(Road& road, const SearchWithout& without, WholeSearch& search,
                                                 const Criterion& criterion, Dataset& data, const WorthAName& worth,
                                                 Drops& drops, Likeliest& likeliest) {
  FittedTrials& trials = search.trials();
  while (true) {
    likeliest.consider(road, data, trials.training_judges());
    Finding& found = road.found;
    if (auto freed = trials.with_told_pins_free(found.current)) found.current = std::move(*freed);
    const std::vector<std::size_t> before = found.effects;
    std::optional<Calibration> judged =
        drop_what_is_not_told(found, road.first.held_out, search, criterion, data, worth, drops);
    const std::vector<std::size_t> dropped = gone(before, found.effects);
    if (!dropped.empty()) found = search.with_rivals_renewed(std::move(found), road.first.held_out);
    if (dropped.empty() || !criterion.remainder(found.current.held_out) || trials.exhausted()) return judged;
    std::vector<std::size_t> refused = dropped;
    std::erase_if(refused, [&](std::size_t effect) { return !trials.refused().contains(effect); });
    const Circumstances as_set = circumstances_of(data);
    const bool training_judged = trials.training_judges();
    Road other = refused.empty()
                     ? Road{road.first, gone_on_without(found, dropped, search, road.first.held_out), as_set}
                     : without(refused);
    Trial so_far = found.current;
    if (trials.training_judges() != training_judged) {  // a search anew may have called them in
      set(data, as_set);
      so_far = search.again(so_far);
      set(data, other.circumstances);
    }
    if (!criterion.material(so_far.held_out, other.found.current.held_out)) {
      trials.let_training_judge(training_judged);
      set(data, as_set);
      return judged;
    }
    remember(other.found.candidates, found.candidates);
    road = std::move(other);
  }
}

}  // namespace

std::optional<Calibration> keep_what_is_told(Road& road, const SearchWithout& without, WholeSearch& search,
                                             const Criterion& criterion, Dataset& data, const WorthAName& worth) {
  FittedTrials& trials = search.trials();
  Likeliest likeliest{road, circumstances_of(data), trials.training_judges()};
  Drops drops;
  while (true) {
    std::optional<Calibration> judged =
        keep_what_errors_tell(road, without, search, criterion, data, worth, drops, likeliest);
    const Loss &after = road.found.current.held_out, &best = likeliest.road.found.current.held_out;
    const bool comparable = trials.training_judges() == likeliest.training_judged;
    const bool nothing_else = removes_most(after, best) && gain(*after.quality, *best.quality) > much_likelier;
    if (drops.costly.empty() || !comparable || !criterion.remainder(after) || !nothing_else) return judged;
    // Nothing has taken the place of what went: its errors are wide since something else is missing beside it. What
    // carried most stays from now on.
    set(data, likeliest.circumstances);
    road = likeliest.road;
    drops.kept.insert(std::ranges::max_element(drops.costly, {}, &std::pair<const std::size_t, double>::second)->first);
    drops.costly.clear();
  }
}

}  // namespace emtb
