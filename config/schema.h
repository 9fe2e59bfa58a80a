#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "config/yaml.h"

namespace emtb {

/// Something in a file that is not as it should be.
struct FileProblem {
  int line = 0;      ///< from 1
  std::string text;  ///< `FILE:LINE: KEY what is wrong, and what would be right`
};

/// Holds a YAML file against a JSON schema (draft 7) and names all that is wrong at once, in the file's order, where a
/// reader stops at the first. Of JSON Schema it knows what config/bench.schema.json uses: type, properties,
/// additionalProperties, required, minProperties, items, minItems, maxItems, enum, const, minimum, exclusiveMinimum,
/// maximum, not const, anyOf, allOf with if and then on a key's const, and $ref to definitions.
/// @throws ConfigError where the file is not YAML, or the schema cannot be read
std::vector<FileProblem> schema_problems(const YamlMap& file, const std::filesystem::path& schema);

}  // namespace emtb
