#pragma once

#include <filesystem>
#include <optional>

namespace emtb {

/// The command line of emtbd.
struct Options {
  std::filesystem::path config;
  std::filesystem::path socket;  ///< empty: the default place
  std::filesystem::path data = "sessions";
  std::filesystem::path replay;  ///< empty: the bench itself
  std::filesystem::path repair;  ///< only repair this session: what emtbd starts itself
  bool safe = false;             ///< only make the reference safe
  std::optional<double> pace;    ///< times real time; infinity: as fast as it goes; absent: as the bench says
  bool help = false;
  bool version = false;
};

/// @throws Error with one line: what is wrong, and what would be right.
Options parse_options(int argc, char** argv);

/// What `--help` prints.
extern const char* const options_help;

}  // namespace emtb
