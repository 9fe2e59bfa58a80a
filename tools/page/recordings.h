#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/page/work.h"

namespace emtb::page {

/// The sessions in the folders that the command line named, and what is noted of them beside the work.
///
/// Nothing outside of these folders is read, whatever a page asks for; no recording is written.
class Recordings {
 public:
  explicit Recordings(const Files& files);

  /// @param work that may use them; null: none
  json list(const Work* work);
  void note(const json& params);
  json data(const json& params, const Mapping& mapping) const;

  /// The file that a page names, where it may be read. @throws Error
  std::filesystem::path checked(const std::string& path) const;

 private:
  json described(const std::filesystem::path& file, const Mapping& mapping) const;
  std::vector<std::filesystem::path> folders() const;
  json notes() const;

  const Files& files_;
  std::map<std::string, std::pair<std::filesystem::file_time_type, json>> known_;
};

/// The profiles that a bench knows, and one of them.
json profile_names(const std::filesystem::path& socket);
json profile(const json& params, const std::filesystem::path& socket);

/// What the daemon's last black box holds.
json black_box(const json& params, const std::filesystem::path& socket);

}  // namespace emtb::page
