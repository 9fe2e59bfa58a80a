#include "drivers/serial_meter/fs9721.h"

#include <array>

#include "drivers/serial_meter/decimal.h"

namespace emtb::serial_meter::fs9721 {
namespace {

constexpr int blank = -1;
constexpr int letter_l = -2;
constexpr int unknown = -3;

/// What seven segments show.
int digit_of(unsigned segments) noexcept {
  constexpr std::array<unsigned, 10> digits{0x7d, 0x05, 0x5b, 0x1f, 0x27, 0x3e, 0x7e, 0x15, 0x7f, 0x3f};
  for (std::size_t d = 0; d < digits.size(); ++d) {
    if (digits[d] == segments) return static_cast<int>(d);
  }
  return segments == 0 ? blank : segments == 0x68 ? letter_l : unknown;
}

/// The lower four bits of each byte, by the number of the byte from 1.
struct Segments {
  std::array<unsigned, frame_length + 1> of{};
  bool at(std::size_t byte, unsigned bit) const noexcept { return (of[byte] >> bit & 1U) != 0; }
};

/// The exponent of the multiplier that is lit; nothing where there are two.
std::optional<int> multiplier(const Segments& s) noexcept {
  struct Prefix {
    std::size_t byte;
    unsigned bit;
    int exponent;
  };
  constexpr std::array<Prefix, 5> prefixes{{{10, 3, -6}, {10, 2, -9}, {10, 1, 3}, {11, 3, -3}, {11, 1, 6}}};
  int lit = 0;
  int exponent = 0;
  for (const Prefix& prefix : prefixes) {
    if (!s.at(prefix.byte, prefix.bit)) continue;
    ++lit;
    exponent = prefix.exponent;
  }
  return lit > 1 ? std::nullopt : std::optional{exponent};
}

/// The quantity of the unit that is lit; nothing where there are two.
std::optional<Quantity> quantity(const Segments& s) noexcept {
  struct Unit {
    std::size_t byte;
    unsigned bit;
    Quantity quantity;
  };
  constexpr std::array<Unit, 6> units{{{12, 3, Quantity::capacitance},
                                       {12, 2, Quantity::resistance},
                                       {13, 3, Quantity::current},
                                       {13, 2, Quantity::voltage},
                                       {13, 1, Quantity::frequency},
                                       {11, 2, Quantity::ratio}}};
  int lit = 0;
  Quantity found = Quantity::other;  // a temperature, on the maker's own segments
  for (const Unit& unit : units) {
    if (!s.at(unit.byte, unit.bit)) continue;
    ++lit;
    found = unit.quantity;
  }
  if (lit > 1) return std::nullopt;
  if (s.at(10, 0)) return found == Quantity::voltage ? std::optional{Quantity::diode} : std::nullopt;
  if (s.at(11, 0)) return found == Quantity::resistance ? std::optional{Quantity::continuity} : std::nullopt;
  return found;
}

}  // namespace

std::optional<Measurement> parse(std::string_view frame) noexcept {
  if (frame.size() != frame_length) return std::nullopt;
  Segments s;
  for (std::size_t byte = 1; byte <= frame_length; ++byte) {
    const auto received = static_cast<unsigned char>(frame[byte - 1]);
    if (received >> 4U != byte) return std::nullopt;
    s.of[byte] = received & 0xfU;
  }
  const bool ac = s.at(1, 3);
  const bool dc = s.at(1, 2);
  const auto exponent = multiplier(s);
  const auto unit = quantity(s);
  if (!s.at(1, 0) || (ac && dc) || !exponent || !unit) return std::nullopt;

  Measurement measurement{.quantity = *unit,
                          .coupling = dc   ? Coupling::dc
                                      : ac ? Coupling::ac
                                           : Coupling::unsaid,
                          .altered = s.at(12, 1) || s.at(12, 0)};
  std::array<int, 4> shown{};
  int behind = 0;  // digits behind the point
  int points = 0;
  for (std::size_t k = 0; k < shown.size(); ++k) {
    const std::size_t byte = 2 + 2 * k;
    shown[k] = digit_of((s.of[byte] & 7U) << 4U | s.of[byte + 1]);
    if (shown[k] == unknown) return std::nullopt;
    if (k > 0 && s.at(byte, 3)) {
      behind = static_cast<int>(shown.size() - k);
      ++points;
    }
  }
  if (points > 1) return std::nullopt;
  if (shown == std::array{blank, 0, letter_l, blank}) {
    measurement.overload = true;
    return measurement;
  }

  double digits = 0;
  bool any = false;
  for (const int digit : shown) {
    if (digit == letter_l || (digit == blank && any)) return std::nullopt;
    if (digit == blank) continue;  // before the first digit a blank stands for a zero
    digits = 10 * digits + digit;
    any = true;
  }
  if (!any) return std::nullopt;
  const bool minus = s.at(2, 3);
  const int percent = *unit == Quantity::ratio ? -2 : 0;
  measurement.value = scaled(minus ? -digits : digits, *exponent + percent - behind);
  measurement.digit = scaled(1, *exponent + percent - behind);
  return measurement;
}

}  // namespace emtb::serial_meter::fs9721
