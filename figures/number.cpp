#include "figures/number.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace emtb {
namespace {

std::string formatted(const char* pattern, int digits, double value) {
  char text[64];
  std::snprintf(text, sizeof text, pattern, digits, value);
  return text;
}

/// Are plain digits easy to read for numbers of that size?
bool plain_size(double value) { return value == 0 || (std::abs(value) >= 1e-4 && std::abs(value) < 1e5); }

struct NamedPower {
  int exponent;
  Prefix prefix;
};
constexpr NamedPower powers[] = {{6, {1e6, "M"}},   {3, {1e3, "k"}},   {0, {1, ""}},
                                 {-3, {1e-3, "m"}}, {-6, {1e-6, "µ"}}, {-9, {1e-9, "n"}}};

/// Does a unit begin with one that takes prefixes? @param multiples also such as kilo
bool takes_prefix(const std::string& unit, bool multiples) {
  const std::string first = unit.substr(0, unit.find_first_of(" /²"));
  const auto among = [&](std::initializer_list<const char*> list) {
    return std::ranges::find(list, first) != list.end();
  };
  return among({"V", "A", "N", "W", "Ω", "Ohm", "H", "J", "Hz", "Pa"}) || (!multiples && among({"rad", "s", "m"}));
}

}  // namespace

Prefix prefix_for(double value) {
  constexpr double least = 0.1;
  for (const auto& [exponent, p] : powers) {
    if (exponent <= 3 && std::abs(value) >= (exponent > 0 ? 10 * p.size : least * p.size)) return p;
  }
  return {};
}

std::optional<Prefix> prefix_for(int exponent, const std::string& unit) {
  const auto own = std::ranges::find(powers, exponent, &NamedPower::exponent);
  if (own == std::end(powers) || !takes_prefix(unit, exponent > 0)) return std::nullopt;
  return own->prefix;
}

std::string printed(double value, const std::string& unit, int digits) {
  Prefix p = std::isfinite(value) ? prefix_for(value) : Prefix{};
  if (!takes_prefix(unit, p.size > 1)) p = {};
  const std::string number = printed(value / p.size, digits);
  return unit.empty() ? number : number + " " + p.letter + unit;
}

std::string superscript(int exponent) {
  static const char* const digits[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string text = exponent < 0 ? "⁻" : "";
  for (const char c : std::to_string(std::abs(exponent))) text += digits[c - '0'];
  return text;
}

std::string with_minus(std::string number) {
  for (std::size_t at = 0; (at = number.find('-', at)) != std::string::npos;) number.replace(at, 1, "−");
  return number;
}

std::string printed(double value, int digits) {
  if (!std::isfinite(value)) return "–";
  std::string text = formatted("%.*e", digits - 1, value);  // rounds first, so that 9.9999 counts as 10
  const double rounded = std::stod(text);
  if (plain_size(rounded)) {
    const int before = rounded == 0 ? 1 : static_cast<int>(std::floor(std::log10(std::abs(rounded)))) + 1;
    text = formatted("%.*f", std::clamp(digits - before, 0, 17), value);
    if (text.find('.') != std::string::npos) {
      text.erase(text.find_last_not_of('0') + 1);
      if (text.back() == '.') text.pop_back();
    }
    return with_minus(text == "-0" ? "0" : text);
  }
  const std::size_t e = text.find('e');
  std::string mantissa = text.substr(0, e);
  if (mantissa.find('.') != std::string::npos) {
    mantissa.erase(mantissa.find_last_not_of('0') + 1);
    if (mantissa.back() == '.') mantissa.pop_back();
  }
  return with_minus(mantissa) + "×10" + superscript(std::stoi(text.substr(e + 1)));
}

std::string printed(double value, double std_error) {
  if (!std::isfinite(value) || !std::isfinite(std_error) || std_error <= 0)
    return printed(value, 4) + " ± " + printed(std_error, 2);
  const double size = std::max(std::abs(value), std_error);
  const int exponent = plain_size(size) ? 0 : static_cast<int>(std::floor(std::log10(size)));
  const double unit = std::pow(10, exponent), v = value / unit, e = std_error / unit;
  const int place = static_cast<int>(std::floor(std::log10(e)));
  const bool leading_one = e / std::pow(10, place) < 1.95;
  const int decimals = std::clamp(-place + (leading_one ? 1 : 0), 0, 12);
  const std::string both = with_minus(formatted("%.*f", decimals, v)) + " ± " + formatted("%.*f", decimals, e);
  return exponent == 0 ? both : "(" + both + ")×10" + superscript(exponent);
}

std::string printed_range(double low, double high) {
  const double size = std::max(std::abs(low), std::abs(high)), width = std::abs(high - low);
  if (!std::isfinite(width) || width == 0) return printed(low) + " … " + printed(high);
  const int exponent = plain_size(size) ? 0 : static_cast<int>(std::floor(std::log10(size)));
  const double unit = std::pow(10, exponent);
  const int decimals = std::clamp(1 - static_cast<int>(std::floor(std::log10(width / unit))), 0, 12);
  const std::string both =
      with_minus(formatted("%.*f", decimals, low / unit) + " … " + formatted("%.*f", decimals, high / unit));
  return exponent == 0 ? both : "(" + both + ")×10" + superscript(exponent);
}

}  // namespace emtb
