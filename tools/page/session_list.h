#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "session/mapping.h"
#include "tools/page/work.h"

namespace emtb::page {

/// The recordings that the page may show: those named on the command line and beside them, the imports, and what the
/// bench has recorded. Notes and tags of the page stand in a file beside the work; no recording is changed.
class SessionList {
 public:
  static constexpr std::size_t most = 500;                                    ///< newest first
  static constexpr std::uintmax_t largest_listed = std::uintmax_t{64} << 20;  ///< [byte] read for the list: larger ones
                                                                              ///< are named only

  SessionList(const Files& files, Mapping mapping, std::filesystem::path imports);

  json list(const Work& work);

  /// All signals of each run, as many readings as a plot shows.
  json data(const json& params) const;

  void note(const json& params);

 private:
  struct Known {
    std::filesystem::file_time_type changed;
    std::uintmax_t size = 0;
    json about;
  };

  std::vector<std::filesystem::path> folders() const;
  std::vector<std::filesystem::path> recordings() const;
  std::filesystem::path allowed(const std::string& path) const;
  const json& about(const std::filesystem::path& path);
  void read_notes();

  const Files files_;
  const Mapping mapping_;
  const std::filesystem::path imports_, notes_file_;
  json notes_ = json::object();
  std::map<std::filesystem::path, Known> known_;
};

}  // namespace emtb::page
