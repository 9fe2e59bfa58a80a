#include "drivers/serial_meter/metex.h"

#include <algorithm>
#include <array>

#include "drivers/serial_meter/decimal.h"

namespace emtb::serial_meter::metex {
namespace {

struct Unit {
  std::string_view text;
  Quantity quantity;
  int exponent;  ///< of ten, to the unit of a Measurement
};

constexpr std::array units{
    Unit{"V", Quantity::voltage, 0},       Unit{"mV", Quantity::voltage, -3},
    Unit{"A", Quantity::current, 0},       Unit{"mA", Quantity::current, -3},
    Unit{"uA", Quantity::current, -6},     Unit{"Ohm", Quantity::resistance, 0},
    Unit{"KOhm", Quantity::resistance, 3}, Unit{"kOhm", Quantity::resistance, 3},
    Unit{"MOhm", Quantity::resistance, 6}, Unit{"pF", Quantity::capacitance, -12},
    Unit{"nF", Quantity::capacitance, -9}, Unit{"uF", Quantity::capacitance, -6},
    Unit{"Hz", Quantity::frequency, 0},    Unit{"KHz", Quantity::frequency, 3},
    Unit{"kHz", Quantity::frequency, 3},   Unit{"MHz", Quantity::frequency, 6},
    Unit{"C", Quantity::temperature, 0},   Unit{"DB", Quantity::other, 0},
    Unit{"dBm", Quantity::other, 0},       Unit{"W", Quantity::other, 0},
    Unit{"", Quantity::unsaid, 0},
};

/// What the frame's first two characters say of the quantity: the unit has to agree.
struct Word {
  std::string_view text;
  Quantity quantity;  ///< unsaid: whatever the unit says
  Coupling coupling = Coupling::unsaid;
  bool altered = false;
};

constexpr std::array words{
    Word{"DC", Quantity::unsaid, Coupling::dc},
    Word{"AC", Quantity::unsaid, Coupling::ac},
    Word{"  ", Quantity::unsaid},
    Word{"OH", Quantity::resistance},
    Word{"CA", Quantity::capacitance},
    Word{"TE", Quantity::temperature},
    Word{"FR", Quantity::frequency},
    Word{"DI", Quantity::diode},
    Word{"CO", Quantity::continuity},
    Word{"DB", Quantity::other},
    Word{"dB", Quantity::other},
    Word{"WT", Quantity::other},
    Word{"HF", Quantity::other},
    Word{"MN", Quantity::unsaid, Coupling::unsaid, true},
    Word{"MX", Quantity::unsaid, Coupling::unsaid, true},
    Word{"AG", Quantity::unsaid, Coupling::unsaid, true},
};

bool agree(const Word& word, const Unit& unit) noexcept {
  if (word.coupling != Coupling::unsaid) {
    return unit.quantity == Quantity::voltage || unit.quantity == Quantity::current;
  }
  switch (word.quantity) {
    case Quantity::unsaid:
      return true;
    case Quantity::diode:
      return unit.quantity == Quantity::voltage || unit.quantity == Quantity::unsaid;
    case Quantity::continuity:
      return unit.quantity == Quantity::resistance || unit.quantity == Quantity::unsaid;
    case Quantity::other:
      return true;
    default:
      return unit.quantity == word.quantity;
  }
}

bool is_overload(std::string_view number) noexcept {
  constexpr std::array<std::string_view, 4> texts{"OL", ".OL", "O.L", "OL."};
  return std::ranges::find(texts, number) != texts.end();
}

}  // namespace

std::optional<Measurement> parse(std::string_view frame) noexcept {
  if (frame.size() != frame_length || frame.back() != '\r') return std::nullopt;
  const auto word = std::ranges::find(words, frame.substr(0, 2), &Word::text);
  const auto unit = std::ranges::find(units, trimmed(frame.substr(9, 4)), &Unit::text);
  if (word == words.end() || unit == units.end() || !agree(*word, *unit)) return std::nullopt;

  std::string_view number = trimmed(frame.substr(2, 7));
  const bool minus = number.starts_with('-');
  if (minus || number.starts_with('+')) number = trimmed(number.substr(1));

  Measurement measurement{.quantity = word->quantity == Quantity::unsaid ? unit->quantity : word->quantity,
                          .coupling = word->coupling,
                          .altered = word->altered};
  if (is_overload(number)) {
    measurement.overload = true;
    return measurement;
  }
  const auto decimal = unsigned_decimal(number, unit->exponent);
  if (!decimal) return std::nullopt;
  measurement.value = minus ? -decimal->value : decimal->value;
  measurement.digit = decimal->digit;
  return measurement;
}

}  // namespace emtb::serial_meter::metex
