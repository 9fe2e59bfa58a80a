#pragma once

#include <string>
#include <string_view>

namespace emtb {

/// A unit as people are shown it: the `1` of a pure number is for programs, and dropped.
inline std::string shown_unit(std::string_view unit) { return unit == "1" ? "" : std::string(unit); }

/// ` N m` behind a number; nothing where there is no unit to show.
inline std::string with_space(std::string_view unit) {
  const std::string shown = shown_unit(unit);
  return shown.empty() ? "" : " " + shown;
}

/// ` [N m]` behind a symbol; nothing where there is no unit to show.
inline std::string in_brackets(std::string_view unit) {
  const std::string shown = shown_unit(unit);
  return shown.empty() ? "" : " [" + shown + "]";
}

}  // namespace emtb
