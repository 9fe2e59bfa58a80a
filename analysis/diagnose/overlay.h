#pragma once

#include <vector>

#include "analysis/record/record.h"
#include "hal/signal.h"
#include "model/model.h"

namespace emtb {

/// One signal of a run, measured over simulated, reading by reading: what a plot shows.
struct Overlay {
  Signal signal{};
  bool slow = false;                     ///< each reading is the mean from `from` to `t`; else an instant, or nearly so
  std::vector<double> from, t;           ///< [s]
  std::vector<double> measured;          ///< SI, as all below
  std::vector<double> simulated;         ///< the mean over the same time
  std::vector<double> sigma;             ///< what the reading may differ from a perfect model
  std::vector<double> residual() const;  ///< measured - simulated

  /// Root of the mean square of the residual, in multiples of sigma: 1 = noise floor.
  double floors() const;
};

/// The overlays of all signals that a weighed record is compared with, in the order of its observations.
std::vector<Overlay> overlays(const Record& record, const Model& model);

}  // namespace emtb
