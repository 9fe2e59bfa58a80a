#include "hal/format_version.h"

#include <charconv>

namespace emtb {

std::string format_words(std::string_view kind, int version) {
  return "emtb " + std::string(kind) + " " + std::to_string(version);
}

std::optional<int> format_version(std::string_view words, std::string_view kind) {
  const std::string start = "emtb " + std::string(kind) + " ";
  if (!words.starts_with(start)) return std::nullopt;
  int version = 0;
  const char* const end = words.data() + words.size();
  const auto [stop, error] = std::from_chars(words.data() + start.size(), end, version);
  if (error != std::errc() || stop != end || version < 0) return std::nullopt;
  return version;
}

std::string made_by_a_newer(std::string_view kind, int version, int newest) {
  return "made by a newer emtb: it is `" + format_words(kind, version) + "`, and this one knows up to " +
         std::to_string(newest) + ". Update emtb here, or use that one";
}

}  // namespace emtb
