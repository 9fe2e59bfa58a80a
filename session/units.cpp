#include "session/units.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <numbers>
#include <span>

namespace emtb {
namespace {

struct Unit {
  std::string_view name;
  UnitConversion conversion;
};

constexpr double turn = 2 * std::numbers::pi;      // [rad]
constexpr double degree = std::numbers::pi / 180;  // [rad]

constexpr std::array volts{Unit{"V", {1, 0}}, Unit{"mV", {1e-3, 0}}, Unit{"kV", {1e3, 0}}};
constexpr std::array amperes{Unit{"A", {1, 0}}, Unit{"mA", {1e-3, 0}}};
constexpr std::array speeds{Unit{"rad/s", {1, 0}},           Unit{"rpm", {turn / 60, 0}}, Unit{"1/min", {turn / 60, 0}},
                            Unit{"rev/min", {turn / 60, 0}}, Unit{"deg/s", {degree, 0}},  Unit{"rev/s", {turn, 0}},
                            Unit{"rps", {turn, 0}}};
constexpr std::array angles{Unit{"rad", {1, 0}}, Unit{"deg", {degree, 0}}, Unit{"rev", {turn, 0}},
                            Unit{"turn", {turn, 0}}, Unit{"turns", {turn, 0}}};
constexpr std::array torques{Unit{"N m", {1, 0}}, Unit{"mN m", {1e-3, 0}}, Unit{"N cm", {1e-2, 0}},
                             Unit{"kgf cm", {0.0980665, 0}}};
constexpr std::array temperatures{Unit{"degC", {1, 0}}, Unit{"C", {1, 0}}, Unit{"K", {1, -273.15}},
                                  Unit{"degF", {5.0 / 9, -160.0 / 9}}, Unit{"F", {5.0 / 9, -160.0 / 9}}};
constexpr std::array<Unit, 1> states{Unit{"1", {1, 0}}};

std::span<const Unit> units_of(Signal signal) {
  switch (signal) {
    case Signal::u_ref:
    case Signal::e_a:
      return volts;
    case Signal::i_a:
    case Signal::i_f:
      return amperes;
    case Signal::omega:
      return speeds;
    case Signal::theta:
      return angles;
    case Signal::torque:
      return torques;
    case Signal::temperature:
      return temperatures;
    default:
      return states;
  }
}

/// Without blanks, points and underscores, which people set as they like: `N m`, `N.m`, `Nm`; `rad_s` is rad/s.
std::string tight(std::string_view unit) {
  std::string out;
  for (const char c : unit) {
    if (std::isalnum(static_cast<unsigned char>(c))) out += c;
  }
  return out;
}

}  // namespace

std::optional<UnitConversion> unit_of(Signal signal, std::string_view unit) {
  for (const Unit& known : units_of(signal)) {
    if (tight(known.name) == tight(unit)) return known.conversion;
  }
  return std::nullopt;
}

std::string_view unit_named(Signal signal, std::string_view unit) {
  for (const Unit& known : units_of(signal)) {
    if (tight(known.name) == tight(unit)) return known.name;
  }
  return {};
}

std::optional<double> time_unit(std::string_view unit) {
  constexpr std::array<std::pair<std::string_view, double>, 5> known{
      {{"s", 1}, {"ms", 1e-3}, {"us", 1e-6}, {"min", 60}, {"h", 3600}}};
  const auto found = std::ranges::find(known, unit, &std::pair<std::string_view, double>::first);
  return found == known.end() ? std::nullopt : std::optional(found->second);
}

std::string known_units(Signal signal) {
  std::string all;
  for (const Unit& unit : units_of(signal)) all += (all.empty() ? "" : ", ") + std::string(unit.name);
  return all;
}

}  // namespace emtb
