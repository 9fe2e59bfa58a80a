#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "analysis/diagnose/criterion.h"
#include "analysis/diagnose/trials.h"

namespace emtb {

/// A fitted model, the scores of what is absent from it, and the refits of the best of them.
struct Round {
  Trial fitted;
  std::vector<Score> scores;
  std::vector<Addition> refits;
  std::optional<Refits> all_refits = {};                  ///< of all effects, once they were asked for
  std::optional<std::vector<Addition>> slow_refits = {};  ///< of those of them that were broken off, likewise
  std::optional<std::vector<Addition>> late_refits = {};  ///< of those that say how late something comes, likewise

  // Of a wave that no spectrum shows, and of two effects at once: each once it was asked for, where there is one.
  std::optional<std::optional<Addition>> whole_orders = {};
  std::optional<std::optional<Pair>> two = {};
};

/// What a search has explored, by the effects that were added to the model with which it began, in whatever order: the
/// same effects are explored once.
class Rounds {
 public:
  /// Both are borrowed.
  Rounds(Trials& trials, const Criterion& criterion) : trials_(trials), criterion_(criterion) {}

  /// The round of some effects. @param fitted the model with them @return null where it has no fit
  Round* explored(const std::vector<std::size_t>& effects, const std::function<std::optional<Trial>()>& fitted);

  /// The round of a fitted model. One that a worse fit of the same effects left behind, in another valley, is explored
  /// anew: all that it says is of another model.
  Round& of(const std::vector<std::size_t>& effects, const Trial& fitted);

  /// That of no effect.
  Round& first() { return rounds_.at({}); }

  const std::vector<Addition>& all_refits_of(Round& round);

  /// Those that all_refits_of() broke off.
  const std::vector<Addition>& slow_refits_of(Round& round);

  /// A wave that no spectrum shows.
  const std::optional<Addition>& whole_orders_of(Round& round);

  /// Two effects at once. @param added those of the round, in the order found
  const std::optional<Pair>& two_of(Round& round, const std::vector<std::size_t>& added);

  /// Those with what says how late something comes, that were not among the promising.
  const std::vector<Addition>& late_refits_of(Round& round);

 private:
  Trials& trials_;
  const Criterion& criterion_;
  std::map<std::vector<std::size_t>, Round> rounds_;
};

}  // namespace emtb
