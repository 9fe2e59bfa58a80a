#pragma once

#include <optional>
#include <string>

namespace emtb {

/// Numbers as they are printed: a true minus, powers of ten with a superscript, the same on every machine.

/// `0.0547`, `7.3×10⁶`, `–` where it is not finite; trailing zeros are left out.
std::string printed(double value, int digits = 4);

/// `0.05469 ± 0.00002`, `(3.449 ± 0.007)×10⁻⁴`: the error with one digit (two where the first is a 1), the value to the
/// same place.
std::string printed(double value, double std_error);

/// `0.0546 … 0.0548`: both ends to the place that tells them apart by two digits.
std::string printed_range(double low, double high);

/// A power of ten with a letter of its own: `m` of mA.
struct Prefix {
  double size = 1;
  const char* letter = "";
};

/// That in which a value reads best: 0.15 V stands as it is, 0.015 V is 15 mV.
Prefix prefix_for(double value);

/// That of an exponent; none where there is none for it, or the unit takes none: kg m² has its k already, and nobody
/// counts kilorads.
std::optional<Prefix> prefix_for(int exponent, const std::string& unit);

/// `52.9 mV`; `3.45×10⁻⁴ kg m²`.
std::string printed(double value, const std::string& unit, int digits);

std::string superscript(int exponent);

/// The hyphens of a number as minus signs.
std::string with_minus(std::string number);

}  // namespace emtb
