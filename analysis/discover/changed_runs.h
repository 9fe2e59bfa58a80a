#pragma once

#include <span>
#include <string>
#include <vector>

#include "analysis/record/dataset.h"
#include "analysis/record/record.h"
#include "model/model.h"

namespace emtb {

/// How a parameter differs from run to run.
enum class ChangeOf { one_run, from_here_on, drift };

/// A parameter that is not the same in all runs.
struct Changed {
  ChangeOf how{};
  std::string run, parameter, unit;    ///< the run, or the first of those that have it
  std::vector<std::string> runs;       ///< all that have it; of a drift all runs
  double from = 0;                     ///< as the other runs have it; of a drift: in the first run
  double to = 0;                       ///< as these have it; of a drift: in the last run
  double std_error = 0;                ///< of the difference: of these runs, and between the others
  Model others;                        ///< fitted to the runs that are as they were; of a drift to all
  double nats = 0;                     ///< by which Q rises, of all runs as they are
  std::vector<std::string> tied_with;  ///< effects of the library that explain the runs as well without a change
};

/// Another value of a parameter, and of what follows it: the flux of the armature makes K_b and K_m alike, so that K_m,
/// where it is free, changes by as much as K_b.
void change_to(Model& model, const std::string& parameter, double value);

/// Parameters that differ from run to run. Needs four runs.
///
/// Which parameter in which run, or from which run on, or along a line through all of them, is foretold by the score
/// test: one column more in the normal equations of all runs, what the model's own parameters imitate of it projected
/// off; K_m goes along with K_b. The best few are fitted: all parameters to the runs that are as they were, then the
/// one to the others alone.
/// A change is told that
///  - is beyond 3 sqrt(se^2 + between^2), between^2 the variance from run to run of the others beside their own errors
///    (between_runs.h), and beyond 3 %,
///  - takes a tenth of what is above the floor from its runs, and a fiftieth of their mean square,
///  - raises Q by 3 nats, also beside the effect of the library that does most for all runs; where it does so only
///    without that effect, it is tied with it or, where the effect does 3 nats more, not told.
/// The best is taken, and of one run the search goes on without it.
/// @throws ModelError where the runs cannot be simulated.
std::vector<Changed> changed_runs(std::span<const Record> records, const Model& fitted);

}  // namespace emtb
