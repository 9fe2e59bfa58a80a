#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "hal/printable.h"

namespace emtb {

/// A message that may hold foreign text: printable(), and no longer than a person reads.
inline std::string in_one_line(std::string_view message) {
  constexpr std::size_t longest = 1000;
  if (message.size() <= longest) return printable(message);
  std::size_t end = longest;
  while (end > 0 && (static_cast<unsigned char>(message[end]) & 0xC0) == 0x80) --end;  // not within a character
  return printable(message.substr(0, end)) + " ...";
}

}  // namespace emtb
