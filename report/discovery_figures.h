#pragma once

#include <optional>
#include <vector>

#include "analysis/discover/discover.h"
#include "analysis/discover/trends.h"
#include "report/page.h"

namespace emtb {

/// The law's curve with its 95 % band, over the missing torque or voltage that it was read from; none without a law.
std::optional<NamedFigure> law_figure(const Discovery& discovery);

/// Each parameter over the sessions: its 95 % intervals, and the straight line with its band where it is clear.
Figure trend_figure(const std::vector<Trend>& trends);

/// What is left after the library, as a section of a report.
void tell(Page& page, const Discovery& discovery);

}  // namespace emtb
