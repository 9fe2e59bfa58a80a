#pragma once

#include <cstddef>
#include <span>

#include "analysis/fit/calibrate.h"
#include "analysis/record/record.h"
#include "model/model.h"

namespace emtb {

/// Do the data tell the size of an effect from nothing, to so many of its standard errors?
bool told_from_zero(const Fit& judged, std::size_t effect, double errors = 3);

/// The same, where what the data cannot tell of the model without it is held where it is (gauge.h): along a factor that
/// they leave free the size of an effect may be anything, but not nothing. One that opens such a factor itself, a
/// driver that never gives more beside a free K_b, is not told by that.
bool told_but_for_scale(std::span<const Record> records, const Fit& judged, std::size_t effect, double errors = 3);

/// A fitted model as it stands, with its standard errors and what rests on a bound.
/// @param quick leaves long blocks and the length of steps out of them
Fit with_standard_errors(std::span<const Record> records, const Model& fitted, bool quick = false);

}  // namespace emtb
