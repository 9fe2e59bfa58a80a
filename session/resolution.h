#pragma once

#include <span>
#include <vector>

namespace emtb {

/// The resolution of an instrument, from what it recorded: the step of the grid on which the values evidently lie, in
/// their unit; else 0.
///
/// A 12-bit converter leaves a few thousand distinct values, evenly spaced but for the rounding of the text they were
/// written in. Taken as evident where at least five distinct values (eight, if some steps are missing between them) lie
/// within 0.15 steps rms of the grid, or four within a thousandth, as a slow meter's few readings do; and where the
/// values keep changing: the levels of a staircase are evenly spaced too, but rarely change. So do the readings of a
/// coarse instrument without noise: where nobody sets them, values that lie on the grid to a thousandth are enough. The
/// two nearest values may be several steps apart, as those of an encoder that turns fast between readings.
/// @param pieces the same channel in each run of a session @param may_be_set by a command, to levels of its own
double resolution(std::span<const std::span<const double>> pieces, bool may_be_set);

/// Do readings lie on a grid of that step?
bool lies_on_grid(std::span<const double> values, double step);

}  // namespace emtb
