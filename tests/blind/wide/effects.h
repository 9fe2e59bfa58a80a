#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tests/blind/hidden.h"
#include "tests/blind/wide/bench.h"

namespace emtb::blind::wide {

/// Something that a bench of any size can hide. Its amplitude is in units of the machine's own volts, torques and
/// times.
struct WideEffect {
  std::string_view id;          ///< the library's, or for what no library has a name of its own
  std::string_view given = {};  ///< an effect that it presumes: plant and model have that one from the start
  bool outside = false;         ///< no library has it
  bool sized = true;            ///< false: it is there or not
  double largest = 5;           ///< times its typical size that is still plausible
  bool (*possible)(const WideBench&) = nullptr;  ///< null: on every bench
  std::vector<TrueParameter> (*hide)(WideBench& bench, double size, Draw draw) = nullptr;
};

/// The library's effects, then what lies outside of it.
std::span<const WideEffect> wide_effects();

/// @throws std::out_of_range
const WideEffect& wide_effect(std::string_view id);

/// The ids that count as right for a truth on this bench: exact aliases by physics.
std::vector<std::string> aliases(std::string_view truth, const WideBench& bench);

}  // namespace emtb::blind::wide
