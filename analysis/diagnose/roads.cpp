#include "analysis/diagnose/roads.h"

#include <utility>

#include "analysis/fit/timing.h"

namespace emtb {
namespace {

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

/// A search at the timing and the starts that are set, and once more where its answer tells others: what the model
/// lacked may have looked like another timing, or another start. The first answer stands where it still does better. By
/// how little an instrument is behind the others only the answer tells.
Road search_from(Dataset& data, WholeSearch& search, Trial first) {
  // Starts bend the fit and the fit the starts.
  for (int again = 0; again < 3 && settle_starts(data, first.model()); ++again) {
    first = search.again(first);
  }
  const WholeSearch::Resettle resettle = [&](const Model& with_the_effect) -> std::optional<Trial> {
    const Circumstances before = circumstances_of(data);
    const bool other_starts = settle_starts(data, with_the_effect);
    if (settle_timing(data, with_the_effect) != TimingChange::other && !other_starts) {
      set(data, before);
      return std::nullopt;
    }
    first = search.again(first);
    return first;
  };
  Finding found = search.from(first, resettle);
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

Road with_timing_or_without(Dataset& data, WholeSearch& search, const Criterion& criterion, const Trial& as_recorded) {
  const Circumstances recorded = circumstances_of(data);
  const TimingChange change = settle_timing(data, as_recorded.model());
  if (change == TimingChange::none) return search_from(data, search, as_recorded);
  if (change == TimingChange::slight) return search_from(data, search, search.again(as_recorded));
  Road told = search_from(data, search, search.again(as_recorded));
  if (!criterion.remainder(told.found.current.held_out)) return told;
  Circumstances in_itself = recorded;
  in_itself.timing.lags_in_itself = true;
  set(data, in_itself);
  Road plain = search_from(data, search, search.again(as_recorded));
  Road& best = criterion.material(told.found.current.held_out, plain.found.current.held_out) ? plain : told;
  set(data, best.circumstances);
  return std::move(best);
}

}  // namespace

Road best_road(Dataset& data, WholeSearch& search, const Criterion& criterion, const Trial& as_recorded) {
  const Circumstances recorded = circumstances_of(data);
  Road road = with_timing_or_without(data, search, criterion, as_recorded);
  FittedTrials& trials = search.trials();
  const FittedTrials::Judges as_set = trials.judges();
  const std::optional<FittedTrials::Judges> better = trials.better_judges(road.found.current);
  if (!better) return road;
  trials.judge_by(*better);
  const Trial so_far = search.again(road.found.current);
  set(data, recorded);
  Road of_all = with_timing_or_without(data, search, criterion, search.again(as_recorded));
  if (criterion.material(so_far.held_out, of_all.found.current.held_out)) return of_all;
  trials.judge_by(as_set);
  set(data, road.circumstances);
  return road;
}

}  // namespace emtb
