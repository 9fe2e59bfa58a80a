#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tests/blind/draw.h"
#include "tests/blind/recording.h"

namespace emtb::blind {

enum class BenchKind { slow, fast };

/// A number that the plant has and that a diagnosis may estimate.
struct TrueParameter {
  std::string symbol;  ///< as the library calls it: `T_c`
  double value = 0;
};

/// Something that a plant can hide.
struct Hidden {
  std::string_view id;            ///< an effect's, or for what no library has a name of its own
  bool slow = true, fast = true;  ///< the benches that it could be found on
  std::string_view given = {};    ///< an effect that it presumes: the plant and the model have that one from the start
  double largest = 6;             ///< times its typical size that is still plausible
  bool outside = false;           ///< no library has it
  bool sized = true;              ///< false: it is there or not
  bool needs_gauge = false, needs_voltage = false;  ///< invisible by nature without that channel

  /// Puts it into the bench's plant (or instruments). Shapes are drawn, the amplitude is `size` times the typical one.
  /// @return its parameters as the library would state them; only where the plant obeys the library's law
  std::vector<TrueParameter> (*hide)(Bench& bench, BenchKind kind, double size, Draw draw) = nullptr;
};

/// All effects of the contract, then what lies outside of any library.
std::span<const Hidden> everything_hidden();

/// @throws std::out_of_range
const Hidden& hidden(std::string_view id);

/// What the literature calls an effect where these data hold nothing that could tell it from another one (section 5 of
/// the contract): all ids that count as right for this truth, the truth first.
std::vector<std::string> right_answers(std::string_view truth, const Bench& bench, BenchKind kind);

}  // namespace emtb::blind
