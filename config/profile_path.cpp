#include "config/profile_path.h"

#include <vector>

#include "hal/error.h"

namespace emtb {

std::filesystem::path profile_path(const std::string& profile, const std::filesystem::path& bench) {
  const std::filesystem::path given(profile);
  std::error_code ignored;
  if (std::filesystem::is_regular_file(given, ignored)) return given;
  if (profile.empty() || given.has_parent_path() || given.extension() == ".yaml") {
    throw ConfigError("profile `" + profile + "`: no such file");
  }

  std::vector<std::filesystem::path> folders;
  if (!bench.empty()) {
    const auto folder = std::filesystem::absolute(bench).parent_path();
    folders = {folder / "profiles", folder.parent_path() / "profiles"};
  }
  folders.emplace_back(EMTB_SOURCE_PROFILES);
  folders.emplace_back(EMTB_INSTALLED_PROFILES);
  std::string looked;
  for (const auto& folder : folders) {
    const auto path = folder / (profile + ".yaml");
    if (std::filesystem::is_regular_file(path, ignored)) return path;
    looked += (looked.empty() ? "" : ", ") + folder.string();
  }
  throw ConfigError("profile `" + profile + "`: no " + profile + ".yaml in " + looked +
                    ". Give a name from there, or a path");
}

}  // namespace emtb
