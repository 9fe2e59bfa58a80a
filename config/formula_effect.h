#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "config/yaml.h"
#include "model/model.h"

namespace emtb {

/// A formula of the user, as it stands among the effects of a model file, or in a file of candidates:
///
///     my_cubic:                           # its id: none of the library's, none of the base parameters'
///       torque: "-c3*omega^3"             # [N m] accelerates; or voltage: [V] added to the armature's terminal
///                                         # voltage; or flux: [1] factor on K_b and K_m, such as "1 - k*abs(i_a)"
///       parameters:
///         c3: {value: 0, min: 0, max: 1.0e-6, null: 0, unit: N m s3/rad3}
///       memory: {z: "(omega - z)/tau"}    # optional: what the formula remembers, z, and dz/dt [1/s]; it starts where
///                                         # it would last. A parameter may stand here alone
///
/// What a formula may hold: config/formula.h. `null` is where the parameter makes the effect vanish, and a search
/// starts; left away, it is 0. A parameter that cannot be 0 and states no null is a shape (the speed at which something
/// falls): a search tries its value and two others within its bounds. Where all that have a null are there, torque and
/// voltage must be 0 and the flux 1.
bool is_formula(const YamlMap& effects, std::string_view id);

/// @throws ConfigError with file, line and key.
AddedTerm read_formula(const YamlMap& effects, const std::string& id);

/// As read_formula() reads it.
void write_formula(YAML::Emitter& out, const AddedTerm& term);

/// A file of formulas, one or more, that a search may add: `--candidates FILE`. They may stand under `effects:`.
/// @throws ConfigError with file, line and key.
std::vector<AddedTerm> read_candidates(const std::filesystem::path& path);

/// Offers a model the formulas of a file.
/// @throws ConfigError where the model includes another formula under the same id.
void offer(Model& model, const std::filesystem::path& candidates);

}  // namespace emtb
