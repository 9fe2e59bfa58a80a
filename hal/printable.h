#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace emtb {

/// Foreign text for a terminal, in one line: what would move the cursor, colour or end the line is shown as `?`.
/// @param but characters that stay: "\n\t" of a file that is shown as it stands
inline std::string printable(std::string_view text, std::string_view but = {}) {
  std::string out(text);
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (but.find(out[i]) != std::string_view::npos) continue;
    const auto c = static_cast<unsigned char>(out[i]);
    const auto next = i + 1 < out.size() ? static_cast<unsigned char>(out[i + 1]) : 0U;
    if (c < 0x20 || c == 0x7f) out[i] = '?';
    if (c == 0xC2 && next >= 0x80 && next < 0xA0) out[i] = out[i + 1] = '?';  // control characters above ASCII
  }
  return out;
}

}  // namespace emtb
