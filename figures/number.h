#pragma once

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

std::string superscript(int exponent);

/// The hyphens of a number as minus signs.
std::string with_minus(std::string number);

}  // namespace emtb
