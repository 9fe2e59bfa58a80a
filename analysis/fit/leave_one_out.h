#pragma once

#include <span>
#include <vector>

#include "analysis/fit/calibrate.h"
#include "analysis/record/record.h"
#include "model/model.h"

namespace emtb {

/// The models by which records judge a fit of all of them, each in its turn: that of k leaves of record k what the
/// other records foretell wrongly of it, as far as they tell the parameters at all.
///
/// Without record k the optimum moves, and the residual there has the covariance I + S_k (A - H_k)^-1 S_k' of noise and
/// of what the others leave open; A = sum of H_j, H_j = S_j' S_j. Whitened it is (I - S_k A^-1 S_k')^(-1/2) r_k with
/// r_k what the fit of all leaves, which is what a shift of the parameters leaves. (Residuals of records left out:
/// Allen 1974. Prediction by parts with their covariance: Dawid 1984.) Where the others tell the parameters well it is
/// what their own fit leaves; where record k alone tells one, it is not blamed that they cannot foretell it.
/// @param options of the fit of all
/// @throws ModelError as calibrate()
std::vector<Model> judged_in_turn(std::span<const Record> records, const Fit& of_all, CalibrationOptions options);

}  // namespace emtb
