#pragma once

#include <string>
#include <string_view>

#include "config/yaml.h"

namespace emtb {

/// What a file says of its own form, `format: emtb KIND VERSION`; 0 where it says nothing. To be asked before any other
/// key: a newer file may have keys that nobody knows here.
/// @throws ConfigError where it is of another kind or newer than `newest`
int read_format(const YamlMap& yaml, std::string_view kind, int newest);

/// What a YAML file of ours is: `bench`, `model`, `profile`, `mapping`, `candidates`, or empty; candidates may also be
/// formulas alone.
std::string kind_of(const YamlMap& yaml);

/// A bench's or model's file as this emtb would write it: all that was there, in the newest form. The same text where
/// nothing is to be done.
/// @throws ConfigError where the file is of another kind, newer, or not readable
std::string upgraded(const std::string& text, const std::string& name);

}  // namespace emtb
