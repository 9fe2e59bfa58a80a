#pragma once

#include <comedilib.h>

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace emtb::comedi {

/// What a subdevice's input or output reaches [V].
struct Range {
  double min = 0;
  double max = 0;
};

/// How the two ends of a voltage are wired to the card.
enum class Wiring { single_ended, differential, common };

/// The narrowest range that holds all of `wanted`: the finest steps. @return its number; nothing: none does
std::optional<std::size_t> narrowest(std::span<const Range> ranges, Range wanted) noexcept;

/// `-10 to 10, -5 to 5`: for messages.
std::string in_words(std::span<const Range> ranges);

/// An entry of a command's channel list.
unsigned int pack(unsigned int channel, std::size_t range, Wiring wiring) noexcept;

/// Between codes and volts, by polynomials: what the card's calibration says, or the straight line of a nominal range.
struct Converter {
  comedi_polynomial_t to_volts{};
  comedi_polynomial_t to_code{};
  lsampl_t top = 0;       ///< the highest code
  bool unipolar = false;  ///< code 0 is 0 V: an end of the range, but no overload

  double volts(lsampl_t code) const noexcept;
  lsampl_t code(double volts) const noexcept;  ///< the nearest, within what the converter has
  /// At an end of the range: the voltage may be anything beyond.
  bool saturated(lsampl_t code) const noexcept { return code >= top || (code == 0 && !unipolar); }
};

/// Code 0 is the range's min, the highest code its max.
Converter nominal(Range range, lsampl_t top) noexcept;

/// What the two clocks of a card can do of a rate: the period of a scan that a command was rounded to.
/// @param count of channels
/// @return [s], or nothing where the command is not paced by a timer
std::optional<double> scan_period(const comedi_cmd& command, std::size_t count) noexcept;

}  // namespace emtb::comedi
