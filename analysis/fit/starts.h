#pragma once

#include <Eigen/Core>
#include <vector>

#include "analysis/record/dataset.h"
#include "model/model.h"

namespace emtb {

/// Sets the states in which those runs begin that do not begin at rest: the speed, which first readings tell as well as
/// they can, and where nobody reads its terminals, the driver, which may be on its way to a reference set before. Both
/// are what a descent makes of all the run's readings, and only where that takes away clearly more than chance would.
/// Those of runs held out, too: they are as little known.
/// @param fitted to the training runs @return whether any is another than before
bool settle_starts(Dataset& data, const Model& fitted);

/// How many numbers are not known of how a record begins.
Eigen::Index unknowns_of_start(const Record& record, const Model& model);

/// By how much what is left of a record changes with what is not known of its start: the speed, and the driver where
/// that is free. One for each of them, of all residuals of the record, in their order; empty where it begins at rest.
/// @param record is the same again afterwards
std::vector<std::vector<Eigen::VectorXd>> slopes_of_start(Record& record, const Model& model);

}  // namespace emtb
