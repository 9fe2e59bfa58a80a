#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>

#include "analysis/diagnose/compare.h"
#include "analysis/diagnose/diagnose.h"
#include "analysis/fit/profile_likelihood.h"
#include "analysis/investigate/investigate.h"

namespace emtb {

/// A number; null where it is not finite, or unknown.
nlohmann::ordered_json number_json(double value);
nlohmann::ordered_json number_json(const std::optional<double>& value);

/// Results as the contract's JSON (section 6 of the design); what is unknown is null.
nlohmann::ordered_json to_json(const Diagnosis& diagnosis);
/// @param model that was compared
nlohmann::ordered_json to_json(const Comparison& comparison, const Model& model);
nlohmann::ordered_json to_json(const std::map<Signal, SignalFit>& signals);
nlohmann::ordered_json timing_json(const Timing& timing, double interval, const Model& model);
nlohmann::ordered_json rounds_json(const Investigation& investigation);

/// The run that was foretold; null where none was made.
nlohmann::ordered_json foretold_json(const Investigation& investigation);

/// @param pins those that are held get `pinned: true`, those that go with them `scaled_with`
nlohmann::ordered_json parameters_json(const Model& model, const LikelihoodIntervals& intervals = {},
                                       std::span<const Pin> pins = {});

/// Writes to a file, or for `-` to standard output; nothing where the name is empty. @throws Error where it cannot.
void write_json(const std::string& file, const nlohmann::ordered_json& value);

}  // namespace emtb
