#include "drivers/usb1608g/calibration.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace emtb::usb1608g {
namespace {

constexpr double half = 32768;       // the code of 0 V
constexpr double output_range = 10;  // [V]

float float_at(std::span<const std::uint8_t> bytes) noexcept {
  std::uint32_t bits = 0;
  for (std::size_t k = 0; k < 4; ++k) bits |= static_cast<std::uint32_t>(bytes[k]) << (8 * k);
  return std::bit_cast<float>(bits);
}

}  // namespace

std::optional<Correction> correction(std::span<const std::uint8_t> table, std::size_t n) noexcept {
  constexpr std::size_t pair = 8;  // [bytes]
  if (table.size() < pair * (n + 1)) return std::nullopt;
  const Correction read{.slope = static_cast<double>(float_at(table.subspan(pair * n))),
                        .offset = static_cast<double>(float_at(table.subspan(pair * n + 4)))};
  const bool sane = read.slope >= 0.9 && read.slope <= 1.2 && std::abs(read.offset) < 10000;  // false for NaN, too
  return sane ? std::optional{read} : std::nullopt;
}

double volts_of(std::uint16_t code, const Correction& correction, double full_scale) noexcept {
  return (correction.slope * code + correction.offset - half) / half * full_scale;
}

std::uint16_t code_of(double volts, const Correction& correction) noexcept {
  const double code = (volts / output_range * half + half) * correction.slope + correction.offset;
  return static_cast<std::uint16_t>(std::lround(std::clamp(code, 0.0, 65535.0)));
}

}  // namespace emtb::usb1608g
