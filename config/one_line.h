#pragma once

#include <string>

#include "hal/printable.h"

namespace emtb {

/// A message that may hold what stands in a file: in one line, and no longer than a person reads.
inline std::string in_one_line(std::string message) {
  constexpr std::size_t longest = 1000;
  if (message.size() > longest) message = message.substr(0, longest) + " ...";
  return printable(message);
}

}  // namespace emtb
