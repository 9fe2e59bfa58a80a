#pragma once

#include <string>

namespace CLI {
class App;
}

namespace emtb {

/// The command line as others want it, all from the one tree that parses it: `man` a manual page, `bash` and `zsh`
/// completions.
/// @throws Error where it is none of these.
std::string written_as(const std::string& kind, const CLI::App& app);

}  // namespace emtb
