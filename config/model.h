#pragma once

#include <filesystem>
#include <string>

#include "config/yaml.h"
#include "model/model.h"

namespace emtb {

/// Reads and checks a model file: `config/models/NAME.yaml`.
///
///     name: fh2
///     input: u_ref                 # u_ref, e_a, or i_a for a current drive
///     driver: {gain: 18.333, rise: 22.5, fall: 20.4, min: 0, max: 110}      # V/V, V/s, V/s, V, V; absent: ideal
///     tie: {K_m: K_b}              # optional
///     parameters:
///       R_a: {value: 31.8, min: 5, max: 100, unit: ohm}                     # or: value, fixed: true
///     bench: {field: magnets, speed: encoder}     # optional: or winding, tachogenerator; what no reading tells
///     noise: {omega: 0.15}         # optional: declared sigma
///     effects: {}                  # coulomb_friction: {T_c: {value: 0.05, min: 0, max: 1, unit: N m}}
///                                  # or a formula of the user: config/formula_effect.h
///     history: []                  # written by emtb
/// @throws ConfigError with file, line and key.
Model read_model(const std::filesystem::path& path);
Model read_model(const YamlMap& yaml);

/// The model as YAML, as read_model() reads it.
std::string to_yaml(const Model& model);

/// @throws ConfigError where the file cannot be written.
void write_model(const std::filesystem::path& path, const Model& model);

}  // namespace emtb
