#pragma once

#include <array>
#include <charconv>
#include <cmath>

namespace emtb {

/// With seven digits, which is more than a screen shows and half as long to send. What is no number stays so.
inline double rounded(double value) {
  if (!std::isfinite(value)) return value;
  std::array<char, 32> text;
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, 7).ptr;
  double out = value;
  std::from_chars(text.data(), end, out);
  return out;
}

}  // namespace emtb
