#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <utility>

#include "config/yaml.h"

namespace emtb {

/// A number for a key.
using KeyedNumber = std::pair<std::string, double>;

/// A YAML file's text with some numbers of one of its maps replaced or added, and nothing else: layout, order and
/// comments stay. The note goes into the comment at the end of that line, in place of an older note that begins with
/// the same word.
/// @param name what messages call the file @param path the keys that lead to the map
/// @throws ConfigError where the map is written in a way (aliases, quoted numbers) that cannot be edited safely
std::string edited(const std::string& text, const std::filesystem::path& name, std::span<const std::string> path,
                   std::span<const KeyedNumber> numbers, const std::string& note);

}  // namespace emtb
