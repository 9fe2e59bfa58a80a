#pragma once

#include "analysis/estimate/static_estimate.h"
#include "figures/figure.h"

namespace emtb {

/// The figure of a static experiment: its points and, where there is one, the line through them down to x = 0, where
/// its intercept is read. Also for an experiment that gives no numbers.
Figure figure_of(const StaticEstimate& estimate);

/// Whether there is anything to draw.
bool has_points(const StaticEstimate& estimate);

}  // namespace emtb
