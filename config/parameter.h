#pragma once

#include <string>
#include <string_view>

#include "config/yaml.h"
#include "model/model.h"

namespace emtb {

/// Reads a parameter as model files state it: `{value: 31.8, min: 5, max: 100, unit: ohm}`, or with `fixed: true`,
/// `prior: {value, std}`, `std_error`.
/// @param parent the map in which it stands under its symbol
/// @param least, most what its bounds are where the file states none, and (least) what they cannot be below
/// @throws ConfigError with file, line and key.
Parameter read_parameter(const YamlMap& parent, const std::string& symbol, std::string_view unit, double least,
                         double most);

/// The same without a look at which keys there are and at the unit: both are the caller's.
Parameter read_parameter_body(const YamlMap& yaml, const std::string& symbol, const std::string& unit, double least,
                              double most);

/// As read_parameter() reads it. `null` is written for one that has it: see config/formula_effect.h.
void write_parameter(YAML::Emitter& out, const Parameter& p, double null = 0);

/// Short and exact enough: nine digits are more than any bench can tell.
std::string yaml_number(double value);

}  // namespace emtb
