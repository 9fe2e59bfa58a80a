#pragma once

#include <span>
#include <vector>

#include "analysis/fit/calibrate.h"
#include "analysis/record/record.h"
#include "model/model.h"

namespace emtb {

/// The models that records tell without one of them each, from the fit of all: that of k comes without record k, which
/// then judges it unseen.
///
/// Without one record the normal equations of the others lead from the optimum of all to theirs by a step. Where that
/// step is long, it has to keep what it promises when the others are simulated; where it does not, they are fitted
/// anew.
/// @param options of the fit of all
/// @throws ModelError as calibrate()
std::vector<Model> fits_without_each(std::span<const Record> records, const Fit& of_all, CalibrationOptions options);

}  // namespace emtb
