#pragma once

#include <cstdlib>
#include <filesystem>

namespace emtb {

/// Where the user keeps what emtb makes for itself, by the XDG base directories: emtb's folder in the one that the
/// environment names, else in the usual one below $HOME; empty where neither is known.
/// @param variable XDG_STATE_HOME ... @param usual `.local/state` ...
inline std::filesystem::path user_folder(const char* variable, const char* usual) {
  const auto absolute = [](const char* of) { return of != nullptr && *of == '/'; };
  if (const char* named = std::getenv(variable); absolute(named)) return std::filesystem::path(named) / "emtb";
  if (const char* home = std::getenv("HOME"); absolute(home)) return std::filesystem::path(home) / usual / "emtb";
  return {};
}

}  // namespace emtb
