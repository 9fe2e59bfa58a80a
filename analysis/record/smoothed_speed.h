#pragma once

#include <optional>
#include <span>

#include "session/session.h"

namespace emtb {

/// A logger that smooths writes y_k = a y_(k-1) + (1 - a) x_k, from nothing on.
///
/// Wherever two of its raw readings x are equal, the change of y is a times the one before it: at rest, and where few
/// counts fall in a row, often. The share a on which most changes agree, to the last digit that was written; none
/// where fewer do than chance would have.
/// @param speeds that were logged alike
std::optional<double> share_kept(std::span<const Series> speeds);

/// The raw readings x of a smoothed speed.
Series before_smoothing(const Series& smoothed, double kept);

/// What the last digit of a smoothed speed may be off by in its raw readings, in its unit.
double rounding_before_smoothing(std::span<const Series> smoothed, double kept);

}  // namespace emtb
