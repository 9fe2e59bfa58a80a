#pragma once

#include <array>
#include <charconv>
#include <string>

namespace emtb::blind {

/// A number with so many digits behind the point.
inline std::string rounded(double value, int digits) {
  std::array<char, 64> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed, digits);
  return {text.data(), end.ptr};
}

}  // namespace emtb::blind
