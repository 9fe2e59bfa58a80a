#pragma once

#include <cmath>
#include <optional>
#include <string_view>

namespace emtb::serial_meter {

constexpr bool is_digit(char c) noexcept { return c >= '0' && c <= '9'; }

/// A number as a display shows it: `-012.34`.
struct Decimal {
  double value = 0;
  double digit = 0;  ///< weight of the last digit: 0.01
};

/// 10^exponent, rounded once.
inline double power_of_ten(int exponent) noexcept { return std::pow(10.0, exponent); }

/// digits * 10^exponent, rounded once: 12.34 is the double that is written 12.34.
inline double scaled(double digits, int exponent) noexcept {
  return exponent < 0 ? digits / power_of_ten(-exponent) : digits * power_of_ten(exponent);
}

/// Digits with at most one point among them, nothing else; at most 15 digits, which a double holds exactly.
/// @param exponent of ten, by which the number is multiplied
/// @return nothing where the text is anything else
inline std::optional<Decimal> unsigned_decimal(std::string_view text, int exponent = 0) noexcept {
  double value = 0;
  int digits = 0;
  int behind = 0;
  bool point = false;
  for (const char c : text) {
    if (c == '.') {
      if (point) return std::nullopt;
      point = true;
    } else if (is_digit(c)) {
      value = 10 * value + (c - '0');
      ++digits;
      behind += point ? 1 : 0;
    } else {
      return std::nullopt;
    }
  }
  if (digits == 0 || digits > 15) return std::nullopt;
  return Decimal{.value = scaled(value, exponent - behind), .digit = scaled(1, exponent - behind)};
}

/// Without blanks at either end.
inline std::string_view trimmed(std::string_view text) noexcept {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  return text;
}

}  // namespace emtb::serial_meter
