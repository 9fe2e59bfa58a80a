#pragma once

#include <charconv>
#include <string>
#include <string_view>

#include "hal/printable.h"

namespace emtb {

/// The shortest text that reads back as the same number.
inline std::string shortest(double value) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

/// Foreign text for use in a one-line message: cut to 40 bytes, control characters replaced.
inline std::string shown(std::string_view text) {
  std::string out = printable(text.substr(0, 40));
  if (text.size() > 40) out += "...";
  return out;
}

/// a, b, c - at most twelve, for messages.
template <class List>
std::string listed(const List& list) {
  std::string out;
  std::size_t count = 0;
  for (const auto& item : list) {
    if (++count > 12) return out + ", ...";
    out += (out.empty() ? "" : ", ") + shown(item);
  }
  return out;
}

}  // namespace emtb
