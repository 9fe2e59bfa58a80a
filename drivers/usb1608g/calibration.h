#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

namespace emtb::usb1608g {

/// corrected code = slope * code + offset
struct Correction {
  double slope = 1;
  double offset = 0;  ///< codes
};

/// What the maker measured of this very card: its memory holds a correction for each range of the inputs and for each
/// output, as pairs of float32.
struct Calibration {
  static constexpr std::uint16_t input_address = 0x7000;
  static constexpr std::uint16_t output_address = 0x7080;
  static constexpr std::size_t input_bytes = 32;
  static constexpr std::size_t output_bytes = 16;

  std::array<Correction, 4> inputs;   ///< by range
  std::array<Correction, 2> outputs;  ///< by channel
};

/// The n-th pair of a table. @return nothing where it cannot be true: not finite, slope not 0.9 to 1.2, offset beyond
/// 10000 codes (an erased memory, one that was never written)
std::optional<Correction> correction(std::span<const std::uint8_t> table, std::size_t n) noexcept;

/// [V] of a code from the converter. Not clipped: a correction may reach a little beyond the range.
double volts_of(std::uint16_t code, const Correction& correction, double full_scale) noexcept;

/// The code of the output nearest to a voltage, within what the converter has.
std::uint16_t code_of(double volts, const Correction& correction) noexcept;

}  // namespace emtb::usb1608g
