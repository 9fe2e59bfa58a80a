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

std::filesystem::path beside_or_shipped(const std::filesystem::path& folder, const std::filesystem::path& named,
                                        const std::string& kind) {
  std::error_code missing;
  const std::filesystem::path beside = folder / named;
  if (std::filesystem::exists(beside, missing)) return beside;
  for (const std::filesystem::path& ours : shipped_folders()) {
    if (std::filesystem::exists(ours / kind / named.filename(), missing)) return ours / kind / named.filename();
  }
  return beside;
}

}  // namespace emtb
