#include "config/profile_path.h"

#include <algorithm>
#include <vector>

#include "config/shipped.h"
#include "hal/error.h"
#include "hal/printable.h"

namespace emtb {
namespace {

std::filesystem::path looked_up(const std::string& name, const std::filesystem::path& bench, const char* right) {
  std::vector<std::filesystem::path> folders;
  if (!bench.empty()) {
    const auto folder = std::filesystem::absolute(bench).parent_path();
    folders = {folder / "profiles", folder.parent_path() / "profiles"};
  }
  for (const auto& folder : shipped_folders()) folders.push_back(folder / "profiles");
  std::string looked;
  std::error_code ignored;
  for (const auto& folder : folders) {
    const auto path = folder / (name + ".yaml");
    if (std::filesystem::is_regular_file(path, ignored)) return path;
    looked += (looked.empty() ? "" : ", ") + folder.string();
  }
  throw ConfigError("profile `" + name + "`: no " + name + ".yaml in " + looked + ". Give " + right);
}

}  // namespace

std::filesystem::path profile_path(const std::string& profile, const std::filesystem::path& bench) {
  const std::filesystem::path given(profile);
  std::error_code ignored;
  if (std::filesystem::is_regular_file(given, ignored)) return given;
  if (profile.empty() || given.has_parent_path() || given.extension() == ".yaml") {
    throw ConfigError("profile `" + profile + "`: no such file");
  }
  return looked_up(profile, bench, "a name from there, or a path");
}

std::filesystem::path named_profile(const std::string& name, const std::filesystem::path& bench) {
  if (is_profile_name(name)) return looked_up(name, bench, "a name from there, or the profile's text: `emtb run FILE`");
  constexpr std::size_t longest = 60;
  throw ConfigError(
      "profile `" + printable(name.substr(0, longest)) + (name.size() > longest ? "..." : "") +
      "`: is no name of letters, digits, _ and -. Paths are read by `emtb run FILE`, which sends the text");
}

bool is_profile_name(const std::string& name) {
  const auto harmless = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  };
  return !name.empty() && std::ranges::all_of(name, harmless);
}

}  // namespace emtb
