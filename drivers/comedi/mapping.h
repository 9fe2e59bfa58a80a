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

/// Puts the bytes that a command delivers together to scans: reads end where they like, within a scan or a sample.
class ScanAssembler {
 public:
  /// @param width [bytes] of a sample: 2, or 4 where the subdevice says SDF_LSAMPL; in the machine's own order
  ScanAssembler(std::size_t channels, std::size_t width) : codes_(channels), width_(width) {}

  /// Calls `scan(codes)` for each scan that is complete.
  template <class Take>
  void feed(std::span<const std::uint8_t> bytes, Take scan) {
    for (const std::uint8_t byte : bytes) {
      lsampl_t& code = codes_[filled_ / width_];
      const std::size_t place = filled_ % width_;
      code = place == 0 ? byte : code | static_cast<lsampl_t>(byte) << 8U * place;
      if (++filled_ < width_ * codes_.size()) continue;
      filled_ = 0;
      scan(std::span<const lsampl_t>(codes_));
    }
  }
  /// How many scans will have been completed when so many more bytes have come.
  std::size_t scans_in(std::size_t bytes) const noexcept { return (filled_ + bytes) / (width_ * codes_.size()); }

 private:
  std::vector<lsampl_t> codes_;
  std::size_t width_;
  std::size_t filled_ = 0;  ///< [bytes]
};

}  // namespace emtb::comedi
