#pragma once

#include <optional>
#include <span>

#include "session/session.h"

namespace emtb {

/// A logger that smooths writes y_k = a y_(k-1) + (1 - a) x_k, from nothing on.
struct Smoothing {
  double kept = 0;      ///< a
  double rounding = 0;  ///< what the last digit that was written may put a raw reading x off by, in its unit
};

/// Wherever two raw readings x are equal, the change of y is a times the one before it: at rest, and where few counts
/// fall in a row, often. The share a on which most changes agree, to the last digit that was written; none where fewer
/// do than chance would have.
/// @param speeds that were logged alike
std::optional<Smoothing> smoothing_of(std::span<const Series> speeds);

/// The raw readings x of a smoothed speed.
Series before_smoothing(const Series& smoothed, double kept);

}  // namespace emtb
