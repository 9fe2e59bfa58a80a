#include "config/profile_list.h"

#include <algorithm>
#include <sstream>

#include "config/profile.h"
#include "config/profile_path.h"
#include "config/shipped.h"
#include "config/yaml.h"
#include "hal/error.h"

namespace emtb {
namespace {

/// The comment that a text begins with, its lines joined.
std::string head_comment(const std::string& text) {
  std::istringstream lines(text);
  std::string about;
  for (std::string line; std::getline(lines, line) && line.starts_with("#");) {
    const std::size_t from = line.find_first_not_of("# \t");
    if (from != std::string::npos) about += (about.empty() ? "" : " ") + line.substr(from);
  }
  return about;
}

ListedProfile listed(const std::filesystem::path& path) {
  const YamlMap yaml = YamlMap::load(path);
  Profile profile = read_profile(path);
  return {path, profile.name(), yaml.text("kind"), head_comment(YamlMap::read_text(path)), profile};
}

}  // namespace

ListedProfile listed_profile(const std::string& name) { return listed(profile_path(name)); }

std::vector<ListedProfile> shipped_profiles() {
  std::error_code missing;
  for (const std::filesystem::path& shipped_folder : shipped_folders()) {
    std::vector<ListedProfile> all;
    for (const auto& entry : std::filesystem::directory_iterator(shipped_folder / "profiles", missing)) {
      if (entry.path().extension() == ".yaml") all.push_back(listed(entry.path()));
    }
    std::ranges::sort(all, {}, &ListedProfile::name);
    if (!all.empty()) return all;
  }
  throw ConfigError("no profiles in " + shipped_folders().front().string() +
                    ". Install emtb, or build it where its source lies");
}

}  // namespace emtb
