#pragma once

#include <cmath>

#include "model/dual.h"

namespace emtb {

/// An output that follows its target no faster than its slew limits allow: where it is at the end of an interval, its
/// mean over it, and for how much of it it is under way. The target stands still meanwhile.
template <class Scalar>
struct Slewed {
  Scalar end{};
  Scalar mean{};
  double under_way = 0;  ///< as a share of the interval
};

/// @param e where the output is at the start @param rise, fall [1/s], positive @param dt [s]
template <class Scalar, class Time>
Slewed<Scalar> slew(const Scalar& e, const Scalar& target, const Scalar& rise, const Scalar& fall, const Time& dt) {
  const Scalar way = target - e;
  const bool up = value_of(way) > 0;
  const Scalar travel = (up ? rise : -fall) * dt;
  if (std::abs(value_of(way)) > std::abs(value_of(travel))) return {e + travel, e + 0.5 * travel, 1};
  if (value_of(way) == 0) return {target, target, 0};
  const Scalar share = way / travel;
  return {target, target - 0.5 * way * share, value_of(share)};
}

}  // namespace emtb
