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
  const Round& first() const { return rounds_.at({}); }

  const std::vector<Addition>& all_refits_of(Round& round);

  /// Those that all_refits_of() broke off.
  const std::vector<Addition>& slow_refits_of(Round& round);

  /// Those with what says how late something comes, that were not among the promising.
  const std::vector<Addition>& late_refits_of(Round& round);

 private:
  Trials& trials_;
  const Criterion& criterion_;
  std::map<std::vector<std::size_t>, Round> rounds_;
};

}  // namespace emtb
