#pragma once

#include <span>

namespace emtb {

/// A sensor beside a reference: what the converter saw while the reference said `value`.
struct SensorPoint {
  double value = 0;    ///< SI
  double raw = 0;      ///< mean of what the converter saw, in volts or what it counts in
  double scatter = 0;  ///< standard error of that mean
};

/// value = scale · raw + offset
struct SensorFit {
  double scale = 0, offset = 0;
  double residual = 0;       ///< SI, root mean square over the points less two; of two points 0
  double worst = 0;          ///< SI, the largest distance of a point from the line
  std::size_t worst_at = 0;  ///< which one
};

/// The straight line through a sensor's points, by least squares in the value: references are typed in, and all of
/// about the same worth.
/// @param lsb [as raw] of the converter
/// @param share of the references' span by which a point may be off the line: more is a mistyped reference, a reading
/// that had not settled, or a sensor that is not straight
/// @throws SessionError for fewer than two references that differ, readings that do not tell them apart (by ten
/// standard errors and ten steps of the converter), or a point off the line
SensorFit fit_sensor(std::span<const SensorPoint> points, double lsb, double share);

}  // namespace emtb
