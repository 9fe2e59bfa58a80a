#include "drivers/serial_meter/scpi.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include "drivers/serial_meter/decimal.h"

namespace emtb::serial_meter::scpi {
namespace {

constexpr double overload_from = 9e37;  // 9.9E+37 on all of them

struct Name {
  std::string_view text;
  Quantity quantity;
  Coupling coupling;
};

constexpr std::array names{
    Name{"VOLT", Quantity::voltage, Coupling::dc},         Name{"VOLT:DC", Quantity::voltage, Coupling::dc},
    Name{"VOLT:AC", Quantity::voltage, Coupling::ac},      Name{"CURR", Quantity::current, Coupling::dc},
    Name{"CURR:DC", Quantity::current, Coupling::dc},      Name{"CURR:AC", Quantity::current, Coupling::ac},
    Name{"RES", Quantity::resistance, Coupling::unsaid},   Name{"FRES", Quantity::resistance, Coupling::unsaid},
    Name{"FREQ", Quantity::frequency, Coupling::unsaid},   Name{"PER", Quantity::other, Coupling::unsaid},
    Name{"CONT", Quantity::continuity, Coupling::unsaid},  Name{"DIOD", Quantity::diode, Coupling::unsaid},
    Name{"TEMP", Quantity::temperature, Coupling::unsaid}, Name{"VOLT:DC:RAT", Quantity::ratio, Coupling::dc},
};

std::string number_text(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

/// `-113,"Undefined header"`
bool is_error_report(std::string_view line) noexcept {
  if (line.starts_with('+') || line.starts_with('-')) line.remove_prefix(1);
  const std::size_t digits = std::min(line.find_first_not_of("0123456789"), line.size());
  return digits > 0 && line.size() >= digits + 3 && line.substr(digits, 2) == ",\"" && line.back() == '"';
}

}  // namespace

std::optional<Measurement> parse(std::string_view number) noexcept {
  bool minus = false;
  if (number.starts_with('-') || number.starts_with('+')) {
    minus = number.front() == '-';
    number.remove_prefix(1);
  }
  const std::size_t e = number.find('E');
  if (e == std::string_view::npos || e < 3 || number[1] != '.') return std::nullopt;
  std::string_view exponent = number.substr(e + 1);
  const bool small = exponent.starts_with('-');
  if (small || exponent.starts_with('+')) exponent.remove_prefix(1);
  if (exponent.size() != 2 || !is_digit(exponent[0]) || !is_digit(exponent[1])) return std::nullopt;
  const int ten = 10 * (exponent[0] - '0') + (exponent[1] - '0');
  const auto decimal = unsigned_decimal(number.substr(0, e), small ? -ten : ten);
  if (!decimal) return std::nullopt;
  // The last digit sent is finer than the meter resolves: `digit` stays unsaid.
  if (decimal->value >= overload_from) return Measurement{.overload = true};
  return Measurement{.value = minus ? -decimal->value : decimal->value};
}

Message classify(std::string_view line) noexcept {
  line = trimmed(line);
  if (is_error_report(line)) return {.kind = Message::Kind::prompt};
  if (line.size() > 2 && line.front() == '"' && line.back() == '"') {
    const auto name = std::ranges::find(names, line.substr(1, line.size() - 2), &Name::text);
    // A function that we do not know is a function all the same, and none that was asked for.
    Measurement said{.quantity = Quantity::other};
    if (name != names.end()) said = {.quantity = name->quantity, .coupling = name->coupling};
    return {.kind = Message::Kind::function, .measurement = said};
  }
  if (const auto measurement = parse(line)) {
    return {.kind = Message::Kind::reading, .measurement = *measurement};
  }
  return {.kind = Message::Kind::noise};
}

Message find(std::string_view received) noexcept { return find_line(received, classify); }

std::vector<std::string> set_up(const Function& function, double range, double line_cycles) {
  std::string name;
  const bool ac = function.coupling == Coupling::ac;
  if (function.coupling == Coupling::ac_and_dc) return {};
  if (function.quantity == Quantity::voltage) name = ac ? "VOLT:AC" : "VOLT:DC";
  if (function.quantity == Quantity::current) name = ac ? "CURR:AC" : "CURR:DC";
  if (function.quantity == Quantity::resistance) name = "RES";
  if (function.quantity == Quantity::frequency) name = "FREQ";
  if (name.empty()) return {};
  std::vector<std::string> lines{"\n", "*CLS\n", "SYST:REM\n"};
  lines.push_back("CONF:" + name + (range > 0 ? " " + number_text(range) : std::string()) + "\n");
  if (line_cycles > 0 && !ac && function.quantity != Quantity::frequency) {
    lines.push_back(name + ":NPLC " + number_text(line_cycles) + "\n");
  }
  return lines;
}

}  // namespace emtb::serial_meter::scpi
