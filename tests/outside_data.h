#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

namespace emtb {

/// The folder of recordings of benches that are not ours, which EMTB_DATA names; its default may be absent.
inline std::filesystem::path outside_data() {
  const char* named = std::getenv("EMTB_DATA");
  return named != nullptr ? std::filesystem::path(named) : std::filesystem::path(EMTB_SOURCE_DIR) / "../shared/data";
}

/// Why tests of them are skipped; empty: they are there.
inline std::string no_outside_data() {
  const std::filesystem::path folder = outside_data();
  if (std::filesystem::is_directory(folder)) return {};
  return "no outside data at " + folder.string() + "; name their folder in EMTB_DATA";
}

}  // namespace emtb
