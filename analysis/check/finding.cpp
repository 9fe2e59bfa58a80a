#include "analysis/check/finding.h"

#include <array>

namespace emtb {

std::string_view name_of(Flaw flaw) {
  constexpr std::array<std::string_view, 12> names{"scale",  "sign",  "clipped",     "held",      "spikes",     "gap",
                                                   "jitter", "delay", "angle_speed", "duplicate", "resolution", "rest"};
  return names[static_cast<std::size_t>(flaw)];
}

}  // namespace emtb
