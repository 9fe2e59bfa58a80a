#pragma once

#include <string>
#include <utility>
#include <vector>

namespace emtb {

/// What this machine's C compiler (`cc`, or $CC) makes of some sources: a shared library, as bytes.
/// @param files path and text of each @param source which of them is compiled; it finds the others beside itself
/// @throws Error where there is no compiler, with how to get one, or it complains
std::string compiled_library(const std::vector<std::pair<std::string, std::string>>& files, const std::string& source);

}  // namespace emtb
