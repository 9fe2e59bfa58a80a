#include "analysis/diagnose/roads.h"

#include <algorithm>
#include <array>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "analysis/diagnose/moves.h"
#include "analysis/diagnose/null_fit.h"
#include "analysis/diagnose/plausibility.h"
#include "analysis/fit/starts.h"
#include "analysis/fit/timing.h"
#include "model/catalogue.h"

namespace emtb {
namespace {

/// Adds an effect that leaves less, but only at the timing that it tells together with what was found.
/// @param recorded the timing from which both are told @param asked of which effects
/// @return whether one was added, and that timing set
bool joins_at_its_own_timing(Dataset& data, WholeSearch& search, const Criterion& criterion, const Timing& recorded,
                             const std::function<bool(std::size_t effect)>& asked, Finding& found) {
  if (!search.has_room(found) || std::ranges::none_of(absent_effects(found.current.model()), asked)) return false;
  const Circumstances as_set = circumstances_of(data);
  FittedTrials& trials = search.trials();
  std::vector<Score> scores = trials.scores_about(found.current);
  std::erase_if(scores, [&](const Score& s) { return !asked(s.effect); });
  if (scores.empty()) return false;
  set_timing(data, recorded);
  const std::vector<Addition> refits = trials.refits(search.again(found.current), scores, Breadth::all).done;
  for (const Addition& a : refits) {
    set_timing(data, recorded);
    settle_timing(data, a.trial.model());
    std::optional<Trial> both = trials.fit_to_the_end(a.trial.model());
    if (!both || !trials.determined(both->model(), a.effect())) continue;
    const Loss& without = found.current.held_out;
    if (!criterion.material(without, both->held_out)) continue;
    if (const auto member = same_family_as(a.effect(), found.effects, found.current)) {
      const auto before = found.before.find(*member);
      const Loss& before_both = before != found.before.end() ? before->second : without;
      if (!criterion.material_beside_same_edges(before_both, without, both->held_out)) continue;
    }
    found.add(a.effect(), std::move(*both));
    return true;
  }
  set(data, as_set);
  return false;
}

/// What shapes the same edges as a member may leave nothing beside it.
bool joins_its_family(Dataset& data, WholeSearch& search, const Criterion& criterion, Finding& found) {
  const auto of_the_family = [&](std::size_t effect) {
    return says_how_late(effect) && same_family_as(effect, found.effects, found.current).has_value();
  };
  return joins_at_its_own_timing(data, search, criterion, timing_as_recorded(data.timing), of_the_family, found);
}

/// A model fitted at the timing and the starts that it tells itself, which are set; none where those that are set are
/// its own, or it has no fit.
std::optional<Trial> at_its_own_timing(Dataset& data, FittedTrials& trials, const Model& model) {
  std::optional<Trial> fitted;
  for (int again = 0; again < 2; ++again) {
    const Model& told_by = fitted ? fitted->model() : model;
    const bool other_starts = settle_starts(data, told_by);
    if (settle_timing(data, told_by) == TimingChange::none && !other_starts) break;
    fitted = trials.fit_to_the_end(model);
    if (!fitted) break;
  }
  return fitted;
}

/// What comes near a member that says how late edges come is held against it at the timing and the starts that it tells
/// itself: those that are set are the member's own, and bend every other.
/// @return whether one has taken a member's place, and its timing and starts are set
bool rivals_at_their_own_timing(Dataset& data, WholeSearch& search, const Criterion& criterion, Finding& found) {
  constexpr std::size_t most = 2;  // of each member
  FittedTrials& trials = search.trials();
  bool taken = false;
  for (std::size_t place = 0; place < found.effects.size(); ++place) {
    const std::size_t member = found.effects[place];
    const std::vector<Rival> near = std::exchange(found.near[member], {});
    for (const Rival& rival : std::span(near).first(std::min(near.size(), most))) {
      if (trials.exhausted()) return taken;
      const Circumstances as_set = circumstances_of(data);
      std::optional<Trial> other = at_its_own_timing(data, trials, rival.model);
      const bool counts = other && trials.determined(other->model(), rival.effect);
      if (counts && does_as_well(criterion, found.current, member, *other, rival.effect)) {
        found.rivals[member].push_back({rival.effect, other->model()});
      } else if (counts && does_better(criterion, other->held_out, found.current.held_out)) {
        found.swap(place, rival.effect, std::move(*other));
        taken = true;
        break;
      }
      set(data, as_set);
    }
  }
  return taken;
}

/// Which model tells how the runs begin.
enum class Starts { told_on_the_way, told_by_the_answer };

/// Did some runs begin otherwise?
bool begin_otherwise(const Circumstances& a, const Circumstances& b) {
  return !std::ranges::equal(a.starts, b.starts, [](const InitialState& one, const InitialState& other) {
    return one.omega == other.omega && one.e_driver == other.e_driver;
  });
}

/// A search at the timing and the starts that are set, and once more where its answer tells others: what the model
/// lacked may have looked like another timing, or another start. The first answer stands where it still does better. By
/// how little an instrument is behind the others only the answer tells.
/// @param told the timing that is set is what `first` itself tells: it tells no other where nothing is found
/// @param starts told by the answer: those that are set stay until there is one
Road search_from(Dataset& data, WholeSearch& search, const Criterion& criterion, Trial first, bool told = false,
                 Starts starts = Starts::told_on_the_way) {
  const auto other_starts_told_by = [&](const Model& model) {
    return starts == Starts::told_on_the_way && settle_starts(data, model);
  };
  // Starts bend the fit and the fit the starts.
  for (int again = 0; again < 3 && other_starts_told_by(first.model()); ++again) {
    first = search.again(first);
    told = false;
  }
  const WholeSearch::Resettle resettle = [&](const Model& with_the_effect) -> std::optional<Trial> {
    const Circumstances before = circumstances_of(data);
    const bool other_starts = other_starts_told_by(with_the_effect);
    if (settle_timing(data, with_the_effect) != TimingChange::other && !other_starts) {
      set(data, before);
      return std::nullopt;
    }
    first = search.again(first);
    told = false;
    return first;
  };
  Finding found = search.from(first, resettle);
  if (told && found.effects.empty() && !criterion.worth_a_wide_search(found.current.held_out))
    return {std::move(first), std::move(found), circumstances_of(data)};
  const bool other_starts = settle_starts(data, found.current.model());
  TimingChange change = settle_timing(data, found.current.model());
  const auto search_anew = [&] {
    first = search.again(first);
    found = search.anew_from(first, std::move(found));
    change = settle_timing(data, found.current.model());
  };
  if (change == TimingChange::other || other_starts) search_anew();
  if (criterion.worth_a_wide_search(found.current.held_out) &&
      told_from_the_recorded(data, search, criterion, found.current))
    search_anew();
  if (criterion.worth_a_wide_search(found.current.held_out) && joins_its_family(data, search, criterion, found))
    change = TimingChange::slight;
  if (change != TimingChange::none) {
    first = search.again(first);
    found = search.again(std::move(found), first.held_out);
  }
  if (rivals_at_their_own_timing(data, search, criterion, found)) {
    first = search.again(first);
    found = search.again(std::move(found), first.held_out);
  }
  return {std::move(first), std::move(found), circumstances_of(data)};
}

/// Is half a row of it how the runs were logged, as the timing is set, and the machine where no timing has its shape?
bool may_lag_in_itself(std::size_t effect, const FittedMachine& as_set, const FittedMachine& in_itself) {
  if (effect >= effect_count) return false;
  const std::array half_a_row{0.5 * as_set.seen.sample};
  return effect_catalogue()[effect].parameter_count == half_a_row.size() &&
         !implausible(effect, half_a_row, as_set).empty() && implausible(effect, half_a_row, in_itself).empty();
}

/// What lags by less than a row may be how the runs were logged. Where much is left at the timing that is set, it is
/// the machine: no timing has the shape of a lag.
Road with_a_lag_within_a_row(Dataset& data, WholeSearch& search, const Criterion& criterion, Road road) {
  if (data.timing.lags_in_itself || search.trials().exhausted()) return road;
  const Trial& found = road.found.current;
  if (!criterion.worth_a_wide_search(found.held_out)) return road;
  const FittedMachine as_set = machine_of(data.train, found.model());
  FittedMachine in_itself = as_set;
  in_itself.seen.logged_lag = logged_lag(as_set.seen.sample, true);
  Timing timing = timing_as_recorded(data.timing);
  timing.lags_in_itself = true;
  const auto lags = [&](std::size_t effect) { return may_lag_in_itself(effect, as_set, in_itself); };
  if (!joins_at_its_own_timing(data, search, criterion, timing, lags, road.found)) return road;
  road.first = search.again(road.first);
  road.found = search.again(std::move(road.found), road.first.held_out);
  road.circumstances = circumstances_of(data);
  return road;
}

Road with_timing_or_without(Dataset& data, WholeSearch& search, const Criterion& criterion, const Trial& as_recorded) {
  const Circumstances recorded = circumstances_of(data);
  const TimingChange change = settle_timing(data, as_recorded.model());
  const bool told = change == TimingChange::none;
  Road best = search_from(data, search, criterion, told ? as_recorded : search.again(as_recorded), told);
  const bool remains = criterion.remainder(best.found.current.held_out) && !search.trials().exhausted();
  const auto try_from = [&](const Circumstances& others, Starts starts = Starts::told_on_the_way) {
    set(data, others);
    Road other = search_from(data, search, criterion, search.again(as_recorded), false, starts);
    if (criterion.material(best.found.current.held_out, other.found.current.held_out)) best = std::move(other);
    set(data, best.circumstances);
  };
  if (change == TimingChange::other && remains) {
    Circumstances in_itself = recorded;
    in_itself.timing.lags_in_itself = true;
    try_from(in_itself);
  }
  if (as_recorded.model().input == Signal::e_a && remains && !best.circumstances.timing.held) {
    // What a voltage that goes straight from reading to reading makes of a motor hides what one that holds would show.
    Circumstances held = recorded;
    held.timing.held = true;
    try_from(held);
  }
  if (criterion.worth_a_wide_search(best.found.current.held_out) && begin_otherwise(best.circumstances, recorded) &&
      !search.trials().exhausted()) {
    // A load that pulls from the first row on looks like a run that begins on the way, of a model without it.
    try_from(recorded, Starts::told_by_the_answer);
  }
  return with_a_lag_within_a_row(data, search, criterion, std::move(best));
}

}  // namespace

bool told_from_the_recorded(Dataset& data, WholeSearch& search, const Criterion& criterion, Trial& answer) {
  const Timing recorded = timing_as_recorded(data.timing);
  if (data.timing == recorded) return false;
  const Circumstances as_set = circumstances_of(data);
  set_timing(data, recorded);
  Trial anew = search.again(answer);
  settle_timing(data, anew.model());
  settle_starts(data, anew.model());
  anew = search.again(anew);
  if (criterion.material(answer.held_out, anew.held_out)) {
    answer = std::move(anew);
    return true;
  }
  set(data, as_set);
  return false;
}

Road best_road(Dataset& data, WholeSearch& search, const Criterion& criterion, const Trial& as_recorded) {
  const Circumstances recorded = circumstances_of(data);
  Road road = with_timing_or_without(data, search, criterion, as_recorded);
  FittedTrials& trials = search.trials();
  if (trials.training_judges() || trials.exhausted() || !trials.training_shows_more(road.found.current)) return road;
  const bool held_out_shows_it = criterion.remainder(road.found.current.held_out);
  trials.let_training_judge(true);
  const Trial so_far = search.again(road.found.current);
  set(data, recorded);
  Road of_all = with_timing_or_without(data, search, criterion, search.again(as_recorded));
  const Loss &before = so_far.held_out, &after = of_all.found.current.held_out;
  // What held-out runs show as well, if less of it, they have judged: only what takes most of it away is no crumb.
  if (criterion.material(before, after) && (!held_out_shows_it || removes_most(before, after))) return of_all;
  trials.let_training_judge(false);
  set(data, road.circumstances);
  return road;
}

}  // namespace emtb
