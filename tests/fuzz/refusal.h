#pragma once

#include <string>

#include "hal/error.h"
#include "tests/fuzz/targets.h"

namespace emtb::fuzz {

/// Calls `read`: it does, or refuses by an Error of one short line that a terminal can show.
/// @return whether it was read
template <class Read>
bool read_or_refused(Read read) {
  try {
    read();
    return true;
  } catch (const Error& e) {
    const std::string why = e.what();
    must(!why.empty() && why.size() < 2000, "a refusal is one short line: " + std::to_string(why.size()) + " bytes");
    for (const char c : why) must(static_cast<unsigned char>(c) >= 0x20 && c != 0x7f, "a refusal can be shown: " + why);
    return false;
  }
}

}  // namespace emtb::fuzz
