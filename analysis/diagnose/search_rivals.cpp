// Of a search: what does as well in the place of a member, or better.
#include <algorithm>
#include <optional>
#include <ranges>

#include "analysis/diagnose/moves.h"
#include "analysis/diagnose/search.h"
#include "model/catalogue.h"

namespace emtb {

/// Does another effect do as well in the place of a member, or better?
void Search::swap() {
  for (std::size_t i = 0; i < found_.effects.size(); ++i) {
    if (trials_.exhausted()) return;
    tell(0.6 + 0.2 * static_cast<double>(i) / static_cast<double>(found_.effects.size()), "trying rivals");
    if (!needed(found_.effects[i], found_.current.model())) try_rivals_of(i);
  }
}

void Search::try_rivals_of(std::size_t place) {
  Round* reduced = round_without(place);
  if (reduced == nullptr) return;
  const std::size_t member = found_.effects[place];
  try_in_the_place_of(place, *reduced, reduced->refits);
  if (found_.effects[place] == member) try_in_the_place_of(place, *reduced, alike_in_the_place_of(place, *reduced));
  if (says_how_late(found_.effects[place])) try_in_the_place_of(place, *reduced, rounds_.late_refits_of(*reduced));
}

/// What did as well as a member when that was added, in its place now: what the others have taken meanwhile may leave
/// so little of it to be seen without the member that no score proposes it any more.
std::vector<Addition> Search::alike_in_the_place_of(std::size_t place, const Round& reduced) {
  std::vector<Addition> in_its_place;
  const auto alike = found_.alike.find(found_.effects[place]);
  if (alike == found_.alike.end()) return in_its_place;
  for (const Addition& a : alike->second) {
    const bool is_tried = std::ranges::find(reduced.refits, a.effect(), &Addition::effect) != reduced.refits.end();
    if (is_tried || found_.current.model().includes(a.effect()) || trials_.exhausted()) continue;
    if (auto trial = trials_.fit_to_the_end(with_another(place, a)))
      in_its_place.push_back({a.score, std::move(*trial)});
  }
  return in_its_place;
}

/// The model with an effect in the place of a member, as it was when it did as well.
Model Search::with_another(std::size_t place, const Addition& alike) const {
  Model other = found_.current.model();
  other.exclude(found_.effects[place]);
  other.include(alike.effect());
  other.parameters_of(alike.effect()) = alike.trial.model().parameters_of(alike.effect());
  return other;
}

/// What did as well as a member when that was added, or does so now.
std::vector<Rival> Search::does_as_well_as(std::size_t place) const {
  std::vector<Rival> others;
  const auto take = [&](std::size_t effect, const auto& model) {
    const bool is_taken = std::ranges::find(others, effect, &Rival::effect) != others.end();
    if (!is_taken && !found_.current.model().includes(effect)) others.push_back({effect, model()});
  };
  const std::size_t member = found_.effects[place];
  if (const auto rivals = found_.rivals.find(member); rivals != found_.rivals.end()) {
    for (const Rival& rival : rivals->second) take(rival.effect, [&] { return rival.model; });
  }
  if (const auto alike = found_.alike.find(member); alike != found_.alike.end()) {
    for (const Addition& a : alike->second) take(a.effect(), [&] { return with_another(place, a); });
  }
  return others;
}

/// Some effects make sense beside another one only: of friction that falls with the speed none is seen while a dead
/// zone that does as well stands for the friction. Where something is left, both are tried in the place of that.
bool Search::add_beside_what_is_alike() {
  if (!criterion_.worth_a_wide_search(found_.current.held_out)) return false;
  struct Both {
    std::size_t place, instead;
    Trial one;
    Addition more;
  };
  std::optional<Both> best;
  for (std::size_t place = 0; place < found_.effects.size(); ++place) {
    for (const Rival& other : does_as_well_as(place)) {
      const auto needs_it = [&](std::size_t effect) {
        return found_.current.model().about(effect).needs == id(other.effect) && !dropped_.contains(effect);
      };
      const auto known = std::views::iota(std::size_t{0}, found_.current.model().known_effects());
      if (std::ranges::none_of(known, needs_it) || trials_.exhausted()) continue;
      std::vector<std::size_t> others = found_.effects;
      others[place] = other.effect;
      Round* round = rounds_.explored(others, [&] { return trials_.fit_to_the_end(other.model); });
      if (round == nullptr) continue;
      for (const Addition& more : round->refits) {
        const Loss& left = more.trial.held_out;
        if (!needs_it(more.effect()) || !criterion_.material(found_.current.held_out, left)) continue;
        if (best && !likelier(left, best->more.trial.held_out)) continue;
        if (!told(more.trial, more.effect(), round->fitted.held_out)) continue;
        best = Both{place, other.effect, round->fitted, more};
      }
    }
  }
  if (!best) return false;
  found_.swap(best->place, best->instead, std::move(best->one));
  found_.add(best->more.effect(), std::move(best->more.trial));
  rivals_are_stale_ = true;
  return true;
}

/// @param refits of the model without the member in that place @return whether one of them has taken it
bool Search::try_in_the_place_of(std::size_t place, const Round& reduced, const std::vector<Addition>& refits) {
  Trial& current = found_.current;
  const std::size_t member = found_.effects[place];
  bool taken = false;
  for (const Addition& a : refits) {
    const Trial& trial = a.trial;
    if (!is_rival(reduced, a, member)) continue;
    if (does_better(criterion_, trial.held_out, current.held_out)) {
      found_.swap(place, a.effect(), trial);
      rivals_are_stale_ = taken = true;
    } else {
      set_beside(found_.effects[place], reduced, a);
    }
    remember(a.score, error_with(a));
  }
  return taken;
}

/// Keeps a rival that does as well as a member; or comes near, where both say how late edges come: the timing and the
/// starts that are set are those which the member tells.
void Search::set_beside(std::size_t member, const Round& reduced, const Addition& a) {
  const auto keep = [&](std::vector<Rival>& rivals, const Trial& trial) {
    if (std::ranges::find(rivals, a.effect(), &Rival::effect) == rivals.end())
      rivals.push_back({a.effect(), trial.model()});
  };
  const auto as_well = [&](const Trial& trial) {
    return does_as_well(criterion_, found_.current, member, trial, a.effect());
  };
  if (as_well(a.trial)) return keep(found_.rivals[member], a.trial);
  if (!criterion_.remainder(a.trial.held_out) && !trials_.exhausted()) {  // it may have been on its way still
    const std::optional<Trial> ended = trials_.fit_to_the_end(a.trial.model());
    if (ended && as_well(*ended)) return keep(found_.rivals[member], *ended);
    if (ended && criterion_.tied(found_.current.held_out, ended->held_out)) {  // but for a parameter too many
      for (const Model& fewer : with_fewer_amplitudes(ended->model(), a.effect())) {
        const std::optional<Trial> simpler = trials_.fit_to_the_end(fewer);
        if (simpler && as_well(*simpler)) return keep(found_.rivals[member], *simpler);
      }
    }
  }
  if (says_how_late(member) && says_how_late(a.effect()) && removes_most(reduced.fitted.held_out, a.trial.held_out)) {
    keep(found_.near[member], a.trial);
  }
}

/// Where something is left, it may be that a member stands in for what the scores passed by.
void Search::try_all_in_the_place_of_each() {
  for (std::size_t i = 0; i < found_.effects.size(); ++i) {
    if (!criterion_.worth_trying_all(found_.current.held_out) || trials_.exhausted()) return;
    const std::size_t member = found_.effects[i];
    if (needed(member, found_.current.model())) continue;
    tell(0.87, "trying all effects in the place of " + id(member));
    Round* reduced = round_without(i);
    if (reduced != nullptr && try_in_the_place_of(i, *reduced, rounds_.all_refits_of(*reduced))) settle();
  }
}

/// Rivals that were collected beside a member that has gone since say nothing of the members that stayed.
void Search::renew_rivals() {
  tell(0.88, "trying rivals again");
  found_.rivals.clear();
  found_.near.clear();
  if (trials_.exhausted()) return;
  for (std::size_t i = 0; i < found_.effects.size(); ++i) {
    const std::size_t member = found_.effects[i];
    if (needed(member, found_.current.model())) continue;
    Round* reduced = round_without(i);
    if (reduced == nullptr) continue;
    const auto collect = [&](const Addition& a) {
      if (is_rival(*reduced, a, member)) set_beside(member, *reduced, a);
    };
    std::ranges::for_each(reduced->refits, collect);
    std::ranges::for_each(alike_in_the_place_of(i, *reduced), collect);
    if (says_how_late(member)) std::ranges::for_each(rounds_.late_refits_of(*reduced), collect);
  }
}

/// The round of the model without one of its members; null where it has no fit.
Round* Search::round_without(std::size_t place) {
  std::vector<std::size_t> others = found_.effects;
  others.erase(others.begin() + static_cast<std::ptrdiff_t>(place));
  return rounds_.explored(others, [&] { return fit_without(found_.effects[place]); });
}

/// Is an addition to the model without a member something material of its own?
bool Search::is_rival(const Round& reduced, const Addition& a, std::size_t member) {
  std::vector<std::size_t> others = found_.effects;
  std::erase(others, member);
  const Loss& without = reduced.fitted.held_out;
  return a.effect() != member && criterion_.material(without, a.trial.held_out) &&
         !mends_another(a.effect(), others, without, a.trial.held_out) &&
         trials_.determined(a.trial.model(), a.effect());
}

}  // namespace emtb
