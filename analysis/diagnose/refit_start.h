#pragma once

#include <optional>
#include <span>

#include "analysis/diagnose/score.h"
#include "analysis/fit/rotor_phase.h"
#include "analysis/record/prepared_run.h"
#include "model/model.h"

namespace emtb {

/// Where a refit starts.
struct RefitStart {
  Model model;         ///< with the scored effect
  double squares = 0;  ///< the sum of squares there, in units of sigma^2
  RotorPhases phases;  ///< of the records there
};

/// The model with the scored effect: the whole way that the score expects where that lowers the sum of squares, else as
/// much of it as does; none where it cannot be simulated: a load heavier than the whole rotor.
/// @param squares that sum for the fitted model
/// @param phases of the records, where they are known: followed, not searched
std::optional<RefitStart> with_effect(std::span<const PreparedRun> records, const Model& fitted, double squares,
                                      std::size_t effect, const Score::Start& start,
                                      std::span<const RotorPhase> phases = {});

}  // namespace emtb
