#pragma once

#include <optional>
#include <string_view>

namespace emtb {

/// A factor that comes of a unit taken for another.
struct UnitSlip {
  double factor = 1;
  std::string_view unit;  ///< that the wrong signal is in
  bool of_first = false;  ///< it is the first of the two signals compared that is in that unit
};

/// What unit makes the derivative of an angle so many times a speed: the angle in degrees 57.3, the speed in rpm 1/9.55
/// and so on; nothing where the factor is none of the known ones within 8 %.
std::optional<UnitSlip> unit_slip(double angle_over_speed);

/// Factors by which a reading can be too large by its unit, and what it then is in.
struct UnitFactor {
  double factor = 1;
  std::string_view unit;
};

/// Of a speed: rpm 9.55, deg/s 57.3 ...
/// @param within 1.08: of such a ratio
std::optional<UnitFactor> speed_unit(double too_large, double within);

/// Of a current, a voltage, a torque: thousandths, or thousands.
std::optional<UnitFactor> milli_unit(double too_large, double within);

}  // namespace emtb
