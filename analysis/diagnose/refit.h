#pragma once

#include <optional>
#include <span>

#include "analysis/diagnose/joint_refit.h"
#include "analysis/diagnose/score.h"
#include "analysis/fit/calibrate.h"
#include "analysis/fit/rotor_phase.h"
#include "analysis/record/record.h"
#include "model/model.h"

namespace emtb {

/// Where the refit of a model with one effect more starts.
struct RefitStart {
  Model model;         ///< with the scored effect
  double squares = 0;  ///< the sum of squares there, in units of sigma^2
  RotorPhases phases;  ///< of the records there
};

/// The model with the scored effect: the whole way that the score expects where that lowers the sum of squares, else as
/// much of it as does; none where it cannot be simulated: a load heavier than the whole rotor.
/// @param squares that sum for the fitted model
/// @param phases of the records, where they are known: followed, not searched
std::optional<RefitStart> with_effect(std::span<const Record> records, const Model& fitted, double squares,
                                      std::size_t effect, const Score::Start& start,
                                      std::span<const RotorPhase> phases = {});

/// A fit that is begun: a few steps from a start. At infinite cost where nothing can be simulated from there.
/// @param phases of the records, where they are known
Fit first_steps(std::span<const Record> records, const Model& start, int iterations, RotorPhases phases);

/// A refit that led nowhere, at infinite cost: any other is better.
Fit nowhere(const Model& model);

/// The refit of a fitted model with a scored effect, begun: a few steps from where the score expects it. An effect that
/// fades is scored where it stands, which tells little of where its valley lies: then from each place that was tried.
/// All take two steps, the best two go on, and the lowest counts. What acts within another effect is begun together
/// with it, too (joint_refit.h). At infinite cost where none can be simulated.
/// @param fitted its phases are followed where they hold with the effect
/// @param squares the sum of squares of the fitted model
/// @param valleys where an earlier refit of the effect ended is tried in place of all starts but the best
Fit begun_refit(std::span<const Record> records, const Fit& fitted, double squares, const Score& score,
                const Valleys& valleys = {});

/// The same of the best of some waves whose order no spectrum shows: all whole orders are tried on the shortest runs.
/// None where no score at whole orders promises anything.
struct BegunAtWholeOrders {
  Score score;
  Fit fit;
};
std::optional<BegunAtWholeOrders> begun_at_whole_orders(std::span<const Record> records, const Fit& fitted,
                                                        double squares, std::span<const std::size_t> effects,
                                                        const ScoreOptions& options, const Valleys& valleys = {});

/// A model whose base parameters are as they were given, but for what is fixed: those that were fitted to what lacks
/// something may have bent so far that no descent leads back.
Model with_base_as_given(Model model, const Model& given);

/// The refit of a fitted model with an effect that somebody names, begun wherever the diagnosis would begin it: from
/// all starts of its score and from sizes that the records would clearly show, from the fitted parameters and from
/// those that were given, for a wave also at all whole orders. Where none leads to less than the model without it, from
/// where the effect is as good as absent, so that it ends no worse (but one that is there or not may). At infinite cost
/// where none can be simulated.
Fit begun_refit_with(std::span<const Record> records, const Fit& fitted, const Model& given, std::size_t effect,
                     const ScoreOptions& options = {});

/// Do the rotor phases of a fit hold with an effect more or less? Unless that repeats with the angle itself, or moves
/// an angle that is the integral of the speed's reading.
bool keeps_phases(std::size_t effect, const Model& model);

}  // namespace emtb
