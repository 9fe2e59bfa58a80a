#include "drivers/serial_meter/fluke.h"

#include <algorithm>
#include <array>

#include "drivers/serial_meter/decimal.h"

namespace emtb::serial_meter::fluke {
namespace {

constexpr double overload_from = 1e9;  // +1E+9 on all ranges

struct Unit {
  std::string_view text;  ///< the unit of a reading, and the command that selects the function
  Quantity quantity;
  Coupling coupling;
};

constexpr std::array units{
    Unit{"VDC", Quantity::voltage, Coupling::dc},          Unit{"VAC", Quantity::voltage, Coupling::ac},
    Unit{"VACDC", Quantity::voltage, Coupling::ac_and_dc}, Unit{"ADC", Quantity::current, Coupling::dc},
    Unit{"AAC", Quantity::current, Coupling::ac},          Unit{"AACDC", Quantity::current, Coupling::ac_and_dc},
    Unit{"OHMS", Quantity::resistance, Coupling::unsaid},  Unit{"HZ", Quantity::frequency, Coupling::unsaid},
};

}  // namespace

std::optional<Measurement> parse(std::string_view line) noexcept {
  Measurement measurement;
  const std::size_t gap = line.find(' ');
  if (gap != std::string_view::npos) {
    const auto unit = std::ranges::find(units, trimmed(line.substr(gap)), &Unit::text);
    if (unit == units.end()) return std::nullopt;
    measurement.quantity = unit->quantity;
    measurement.coupling = unit->coupling;
  }
  // S D [. D...] E S D
  const std::string_view number = line.substr(0, gap);
  if (number.size() < 5 || (number[0] != '+' && number[0] != '-')) return std::nullopt;
  const std::string_view mantissa = number.substr(1, number.size() - 4);
  const std::string_view exponent = number.substr(number.size() - 3);
  const bool one_digit_first =
      is_digit(mantissa[0]) && (mantissa.size() == 1 || (mantissa[1] == '.' && mantissa.size() > 2));
  const bool signed_exponent =
      exponent[0] == 'E' && (exponent[1] == '+' || exponent[1] == '-') && is_digit(exponent[2]);
  if (!one_digit_first || !signed_exponent) return std::nullopt;
  const int ten = exponent[2] - '0';
  const auto decimal = unsigned_decimal(mantissa, exponent[1] == '-' ? -ten : ten);
  if (!decimal) return std::nullopt;
  if (decimal->value >= overload_from) {
    measurement.overload = true;
    return measurement;
  }
  measurement.value = number[0] == '-' ? -decimal->value : decimal->value;
  measurement.digit = decimal->digit;
  return measurement;
}

Message classify(std::string_view line) noexcept {
  if (line == "=>") return {.kind = Message::Kind::prompt};
  if (line == "?>" || line == "!>") return {.kind = Message::Kind::refusal};
  if (const auto measurement = parse(line)) return {.kind = Message::Kind::reading, .measurement = *measurement};
  return {.kind = Message::Kind::noise};  // an echo of our own command, for one
}

Message find(std::string_view received) noexcept { return find_line(received, classify); }

std::vector<std::string> set_up(const Function& function) {
  const auto unit = std::ranges::find_if(units, [&](const Unit& u) {
    return u.quantity == function.quantity &&
           (function.coupling == Coupling::unsaid || u.coupling == function.coupling);
  });
  if (unit == units.end()) return {};
  const std::string name = unit->quantity == Quantity::frequency ? "FREQ" : std::string(unit->text);
  return {"REMS\r", "FORMAT 2\r", name + "\r", "RATE S\r"};
}

}  // namespace emtb::serial_meter::fluke
