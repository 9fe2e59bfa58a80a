#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace emtb {

/// What may stand in the place of an option's value or of an argument.
struct Choice {
  std::function<std::vector<std::string>()> words;
  bool only = false;   ///< nothing else may
  bool files = false;  ///< a file may as well
};

/// Those of all commands; of what is not among them nothing is known, and files are offered.
using Choices = std::map<const CLI::Option*, Choice>;

/// The command line as others want it, all from the one tree that parses it: `man` a manual page, `bash` and `zsh`
/// completions.
/// @throws Error where it is none of these.
std::string written_as(const std::string& kind, const CLI::App& app, const Choices& choices);

}  // namespace emtb
