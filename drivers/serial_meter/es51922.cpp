#include "drivers/serial_meter/es51922.h"

#include <algorithm>
#include <array>

#include "drivers/serial_meter/decimal.h"

namespace emtb::serial_meter::es51922 {
namespace {

/// A position of the switch, and the exponent of ten of the last digit in each range.
struct Position {
  static constexpr int no = 127;  ///< no such range
  char code;
  Quantity quantity;
  std::array<int, 8> exponents;
};

constexpr int no = Position::no;
constexpr std::array positions{
    Position{'\x3b', Quantity::voltage, {-4, -3, -2, -1, -5, no, no, no}},
    Position{'\x3d', Quantity::current, {-8, -7, no, no, no, no, no, no}},  // uA
    Position{'\x3f', Quantity::current, {-6, -5, no, no, no, no, no, no}},  // mA
    Position{'\x30', Quantity::current, {-3, no, no, no, no, no, no, no}},  // A
    Position{'\x39', Quantity::current, {-4, -3, -2, -1, no, no, no, no}},  // A by hand
    Position{'\x33', Quantity::resistance, {-2, -1, 0, 1, 2, 3, 4, no}},
    Position{'\x35', Quantity::continuity, {-2, -1, 0, 1, 2, 3, 4, no}},
    Position{'\x31', Quantity::diode, {-4, no, no, no, no, no, no, no}},
    Position{'\x32', Quantity::frequency, {-2, -1, no, 0, 1, 2, 3, 4}},
    Position{'\x36', Quantity::capacitance, {-12, -11, -10, -9, -8, -7, -6, -5}},
    Position{'\x34', Quantity::temperature, {-1, 0, no, no, no, no, no, no}},
};

constexpr std::string_view end = "\r\n";

}  // namespace

std::optional<Measurement> parse(std::string_view frame) noexcept {
  if (frame.size() != frame_length || frame.substr(12) != end) return std::nullopt;
  std::array<unsigned, 12> low{};  // four bits each
  for (std::size_t k = 0; k < low.size(); ++k) {
    const auto byte = static_cast<unsigned char>(frame[k]);
    if (byte >> 4U != 3) return std::nullopt;
    low[k] = byte & 0xfU;
  }
  const auto bit = [&](std::size_t byte, unsigned n) { return (low[byte] >> n & 1U) != 0; };
  const bool judge = bit(7, 3);
  const bool minus = bit(7, 2);
  const bool overload = bit(7, 0);
  const bool held = bit(11, 1);
  const bool relative = bit(8, 1);
  const bool extreme = bit(8, 3) || bit(8, 2) || bit(9, 2) || bit(9, 1);
  const bool underload = bit(9, 3);
  const bool dc = bit(10, 3);
  const bool ac = bit(10, 2);
  const bool frequency_shown = bit(10, 0);  // while the switch stands at V or A
  const bool spare = bit(9, 0) || bit(11, 3);

  const auto position = std::ranges::find(positions, frame[6], &Position::code);
  if (position == positions.end() || low[0] > 7 || spare) return std::nullopt;
  Quantity quantity = position->quantity;
  int exponent = position->exponents[low[0]];
  if (quantity == Quantity::frequency && judge) {  // the duty cycle, in 0.1 %
    quantity = Quantity::ratio;
    exponent = -3;
  }
  if (exponent == no) return std::nullopt;
  const bool has_coupling = quantity == Quantity::voltage || quantity == Quantity::current;
  if (has_coupling && !dc && !ac) return std::nullopt;

  Measurement measurement{.quantity = frequency_shown && has_coupling ? Quantity::other : quantity,
                          .coupling = dc && ac ? Coupling::ac_and_dc
                                      : dc     ? Coupling::dc
                                      : ac     ? Coupling::ac
                                               : Coupling::unsaid,
                          .overload = overload,
                          .altered = held || relative || extreme || underload};
  if (overload) return measurement;  // what the digits show then is not a number
  double digits = 0;
  for (std::size_t k = 1; k <= 5; ++k) {
    if (low[k] > 9) return std::nullopt;
    digits = 10 * digits + low[k];
  }
  measurement.value = scaled(minus ? -digits : digits, exponent);
  measurement.digit = scaled(1, exponent);
  return measurement;
}

}  // namespace emtb::serial_meter::es51922
