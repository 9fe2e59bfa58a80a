#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "analysis/diagnose/diagnose.h"
#include "analysis/fit/calibrate.h"
#include "analysis/fit/profile_likelihood.h"
#include "model/model.h"

namespace emtb {

/// Of the noise floor, whose own digits end there.
std::string error_cell(std::optional<double> error);

/// Values with standard errors, what rests on a bound, what the data do not determine.
/// @param intervals where they were asked for
void print_parameters(const Model& model, const std::vector<std::string>& at_bound,
                      const std::vector<Undetermined>& undetermined, std::span<const Record> records,
                      const LikelihoodIntervals& intervals, std::span<const Pin> pins = {});

/// The most telling map of each signal that is above its floor.
void print_where(const std::vector<ResidualMap>& maps, const std::map<Signal, SignalFit>& signals);

}  // namespace emtb
