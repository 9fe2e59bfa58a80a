#include "analysis/diagnose/rounds.h"

#include <algorithm>
#include <utility>

#include "analysis/diagnose/moves.h"

namespace emtb {
namespace {

/// The same for the same effects in whatever order they were found.
std::vector<std::size_t> key_of(std::vector<std::size_t> effects) {
  std::ranges::sort(effects);
  return effects;
}

/// The scores of what was not refitted.
std::vector<Score> scores_without(std::vector<Score> scores, const std::vector<Addition>& refitted) {
  std::erase_if(scores, [&](const Score& s) {
    return std::ranges::any_of(refitted, [&](const Addition& a) { return a.effect() == s.effect; });
  });
  return scores;
}

}  // namespace

Round* Rounds::explored(const std::vector<std::size_t>& effects, const std::function<std::optional<Trial>()>& fitted) {
  std::vector<std::size_t> key = key_of(effects);
  if (const auto known = rounds_.find(key); known != rounds_.end()) return &known->second;
  std::optional<Trial> trial = fitted();
  if (!trial) return nullptr;
  Round r{std::move(*trial), {}, {}, {}, {}, {}};
  r.scores = trials_.scores(r.fitted);
  if (criterion_.anything_left(r.fitted.held_out))
    r.refits = trials_.refits(r.fitted, r.scores, Breadth::promising).done;
  return &rounds_.emplace(std::move(key), std::move(r)).first->second;
}

Round& Rounds::of(const std::vector<std::size_t>& effects, const Trial& fitted) {
  constexpr double same_valley = 0.99;  // no decision is about less of the cost
  const auto known = rounds_.find(key_of(effects));
  if (known != rounds_.end() && fitted.fit.cost < same_valley * known->second.fitted.fit.cost) rounds_.erase(known);
  return *explored(effects, [&] { return fitted; });
}

const std::vector<Addition>& Rounds::all_refits_of(Round& round) {
  if (!round.all_refits) round.all_refits = trials_.refits(round.fitted, round.scores, Breadth::all);
  return round.all_refits->done;
}

const std::vector<Addition>& Rounds::slow_refits_of(Round& round) {
  if (!round.slow_refits) {
    all_refits_of(round);
    round.slow_refits = trials_.go_on(round.fitted, round.all_refits->broken_off);
  }
  return *round.slow_refits;
}

const std::optional<Addition>& Rounds::whole_orders_of(Round& round) {
  if (!round.whole_orders) round.whole_orders = trials_.refit_at_whole_orders(round.fitted);
  return *round.whole_orders;
}

const std::optional<Pair>& Rounds::two_of(Round& round, const std::vector<std::size_t>& added) {
  if (!round.two) round.two = trials_.refit_of_two(round.fitted, round.scores, added);
  return *round.two;
}

const std::vector<Addition>& Rounds::late_refits_of(Round& round) {
  if (!round.late_refits) {
    std::vector<Score> late = scores_without(round.scores, round.refits);
    std::erase_if(late, [](const Score& s) { return !says_how_late(s.effect); });
    round.late_refits = trials_.refits(round.fitted, late, Breadth::all).done;
  }
  return *round.late_refits;
}

}  // namespace emtb
