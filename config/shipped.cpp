#include "config/shipped.h"

#include "hal/error.h"

namespace emtb {

std::vector<std::filesystem::path> shipped_folders() {
  std::error_code unknown;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", unknown);
  const auto installed = program.parent_path().parent_path() / "share/emtb";
  return {installed, EMTB_SOURCE_CONFIG};
}

std::filesystem::path shipped(const std::filesystem::path& file) {
  std::string looked;
  std::error_code ignored;
  for (const std::filesystem::path& folder : shipped_folders()) {
    if (std::filesystem::is_regular_file(folder / file, ignored)) return folder / file;
    looked += (looked.empty() ? "" : " or ") + folder.string();
  }
  throw ConfigError("no " + file.string() + " in " + looked + ". Install emtb, or build it where its source lies");
}

}  // namespace emtb
