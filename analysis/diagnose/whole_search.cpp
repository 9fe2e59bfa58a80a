#include "analysis/diagnose/whole_search.h"

#include <algorithm>
#include <array>
#include <functional>
#include <utility>
#include <vector>

#include "analysis/diagnose/load_law.h"
#include "analysis/diagnose/moves.h"
#include "analysis/record/thinned.h"

namespace emtb {
namespace {

bool is_torque(Signal signal) { return signal == Signal::torque; }

/// The torque alone of some runs, in rows as far apart as the shaft allows; none where that leaves them all.
std::optional<Dataset> torque_in_few_rows(const Dataset& data) {
  Dataset few = data;
  leave_out(few, std::not_fn(is_torque));
  bool fewer = false;
  for (std::vector<Record>* const records : std::array{&few.train, &few.held_out}) {
    for (Record& record : *records) {
      const std::size_t before = record.length();
      record = thinned(record);
      fewer = fewer || record.length() < before;
    }
  }
  return fewer ? std::optional(std::move(few)) : std::nullopt;
}

}  // namespace

WholeSearch::WholeSearch(Dataset& data, FittedTrials& trials, const Criterion& criterion, const Options& options,
                         Search::Progress progress)
    : data_(data), trials_(trials), criterion_(criterion), options_(options), progress_(std::move(progress)) {}

Finding WholeSearch::from(Trial& first, const Resettle& resettle) {
  if (!options_.torque_only_loads) return search_and_settle(first, resettle);
  if (torque_left_out_) return search(without_effects_of_the_load(first));
  std::optional<Finding> by_law;
  std::vector<std::size_t> law_tried;
  const auto ask_for_a_law_beside = [&](const Model& motion) {
    std::optional<Finding> law = law_beside(motion, first);
    if (!law || law->effects == law_tried) return;
    law_tried = law->effects;
    Finding found = with_the_motion(std::move(*law), first);
    if (!by_law || criterion_.material(by_law->current.held_out, found.current.held_out)) by_law = std::move(found);
  };
  ask_for_a_law_beside(first.model());
  if (by_law && by_law->effects.size() > law_tried.size()) {  // of the motion as it is with what it lacked
    ask_for_a_law_beside(without(by_law->current.model(), concerns_the_load));
  }
  if (by_law && !criterion_.remainder(by_law->current.held_out)) return std::move(*by_law);
  // What the load does at rest is what friction leaves to it, and a law beside a motion that the model lacks may be of
  // that: the motion first, under the torque as it was read.
  Readings torque = leave_out(data_, is_torque);
  const Trial without_torque = again(first);
  Finding motion = search(without_effects_of_the_load(without_torque));
  put_back(data_, std::move(torque));
  if (!motion.effects.empty()) ask_for_a_law_beside(motion.current.model());
  if (by_law && !spoils_the_motion(by_law->current, motion.current)) return std::move(*by_law);
  leave_out(data_, is_torque);
  torque_left_out_ = true;
  first = without_torque;
  return motion;
}

/// Does a law of the load leave of the motion what is explained without it? One that is right leaves nothing that the
/// reading of the torque would not; with one that a shaft's spring has bent, the spring is not seen.
bool WholeSearch::spoils_the_motion(const Trial& with_law, const Trial& without) const {
  constexpr double most_of_it = 0.25;  // by hand
  const auto left = [](const Trial& trial) {
    std::vector<Signal> motion = trial.held_out.signals();
    std::erase_if(motion, is_torque);
    return largest_excess(trial.held_out, motion);
  };
  return criterion_.remainder(with_law.held_out) &&
         (!criterion_.remainder(without.held_out) || left(without) <= (1 - most_of_it) * left(with_law));
}

/// A law of the load, and what else the motion shows beside it.
Finding WholeSearch::with_the_motion(Finding law, const Trial& first) {
  Finding found = search(without_effects_of_the_load(law.current), first.held_out);
  return with_law(std::move(law), std::move(found));
}

Finding WholeSearch::again(Finding found, const Loss& as_given) {
  return Search(trials_, criterion_, std::move(found), as_given, progress_).without_superfluous();
}

Finding WholeSearch::with_rivals_renewed(Finding found, const Loss& as_given) {
  return Search(trials_, criterion_, std::move(found), as_given, progress_).with_rivals_renewed();
}

Finding WholeSearch::gone_on(Finding found, const Loss& as_given) {
  if (options_.torque_only_loads) found.current = without_effects_of_the_load(found.current);
  return Search(trials_, criterion_, std::move(found), as_given, progress_).gone_on(options_.longest_list);
}

Finding WholeSearch::anew_from(Trial& first, Finding before) {
  const std::vector<std::size_t> effects = before.effects;
  Finding kept = Search(trials_, criterion_, std::move(before), first.held_out, progress_).held_against_others();
  if (kept.effects == effects && !criterion_.anything_left(kept.current.held_out)) return kept;
  if (trials_.exhausted()) return kept;
  Finding anew = from(first);
  if (criterion_.material(anew.current.held_out, kept.current.held_out)) return kept;
  return anew;
}

Trial WholeSearch::again(const Trial& fitted) { return trials_.fit(fitted.model(), nullptr).value_or(fitted); }

Finding WholeSearch::search(const Trial& start, const Loss& as_given) {
  return Search(trials_, criterion_, start, as_given, options_.longest_list, progress_).run();
}

Finding WholeSearch::search(const Trial& start) { return search(start, start.held_out); }

Finding WholeSearch::search_and_settle(const Trial& first, const Resettle& resettle) {
  Search search(trials_, criterion_, first, first.held_out, options_.longest_list, progress_);
  const Trial* with_an_effect = resettle ? search.first_step() : nullptr;
  const std::optional<Trial> anew = with_an_effect ? resettle(with_an_effect->model()) : std::nullopt;
  return anew ? this->search(*anew) : search.run();
}

/// Searches for a law of the measured torque, of which the data hold the readings alone, with a model held fast.
std::optional<WholeSearch::Law> WholeSearch::law_of(const Model& open) {
  std::optional<Trial> without = trials_.fit(open, nullptr);
  if (!without) return std::nullopt;
  Finding found = search(*without);
  return Law{std::move(*without), std::move(found)};
}

/// Is there an effect that a law of the torque may be made of, as few rows tell? One that comes near enough and is not
/// refused for its values.
bool WholeSearch::may_have_a_law(const Model& open) {
  std::optional<Dataset> few = torque_in_few_rows(data_);
  if (!few) return true;  // it is asked of all rows anyway
  Dataset whole = std::exchange(data_, std::move(*few));
  const std::optional<Law> law = law_of(open);
  data_ = std::move(whole);
  if (!law) return false;
  const Loss& without = law->without.held_out;
  if (follows_the_torque(without, law->found.current.held_out)) return true;
  return std::ranges::any_of(law->found.candidates, [&](const Candidate& c) {
    return c.held_out_error && !trials_.refused().contains(c.score.effect) &&
           follows_the_torque(without, *c.held_out_error * *c.held_out_error);
  });
}

/// The law of the measured torque, from its reading alone, with a model held fast; put on the first one.
std::optional<Finding> WholeSearch::law_beside(const Model& fitted, const Trial& first) {
  const Model open = with_only_the_load_open(fitted, first.model());
  if (!may_have_a_law(open)) return std::nullopt;
  Readings others = leave_out(data_, std::not_fn(is_torque));
  const std::optional<Law> law = law_of(open);
  put_back(data_, std::move(others));
  if (!law || law->found.effects.empty() || !follows_the_torque(law->without.held_out, law->found.current.held_out))
    return std::nullopt;
  return put_on(law->found, first, trials_, criterion_);
}

}  // namespace emtb
