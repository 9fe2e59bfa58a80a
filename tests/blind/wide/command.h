#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace emtb::blind::wide {

/// How a program ended.
struct Ended {
  int code = 0;         ///< its exit code; -1: by a signal
  bool in_time = true;  ///< false: it was ended by us
  double seconds = 0;
  std::string last_line;  ///< of what it wrote to standard error
};

/// Runs a program in a folder, its output in `LOG` and `LOG.err` there.
/// @param longest [s] after which it is ended
Ended run_command(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                  const std::filesystem::path& folder, const std::string& log, double longest);

/// As somebody would type it.
std::string as_typed(const std::filesystem::path& program, const std::vector<std::string>& arguments);

}  // namespace emtb::blind::wide
