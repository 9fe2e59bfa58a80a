#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <vector>

#include "analysis/fit/calibrate.h"
#include "analysis/record/record.h"
#include "model/model.h"

namespace emtb {

/// Where the last refit of an effect ended.
struct Valley {
  std::vector<double> own;     ///< its parameters
  std::vector<double> needed;  ///< those of the effect within which it acts; empty: it does not
  std::vector<double> base;    ///< those of the motor
};
using Valleys = std::map<std::size_t, Valley>;

/// Where an effect stands in a fitted model that includes it.
Valley valley_of(const Model& fitted, std::size_t effect);

/// Does an effect act within another that a model includes, as a play does within a shaft that twists?
bool acts_within_another(const Model& model, std::size_t effect);

/// The refit of a fitted model with such an effect, begun. The other one was fitted without it and has bent to do so:
/// from there no start of the effect alone leads anywhere. So both start anew together, from all pairs of their places.
/// What the load does in the play hangs on the last bounce, so that the cost is full of small valleys in a wide one:
/// from the best starts the fit hops on to the best of many places around it, as long as that leads further down.
/// @param known phases of the records, where they hold with the effect
/// @param valley where it is known to lie: the only start; null: not known
/// @return at infinite cost where none can be simulated
Fit begun_together(std::span<const Record> records, const Fit& fitted, std::size_t effect, const RotorPhases& known,
                   const Valley* valley);

}  // namespace emtb
