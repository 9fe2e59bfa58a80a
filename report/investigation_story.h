#pragma once

#include <string>

#include "analysis/investigate/investigate.h"
#include "report/page.h"

namespace emtb {

/// How an investigation came to what it found: a table of the rounds, and the prediction over what came.
void tell(Page& page, const Investigation& investigation);

/// What somebody is asked before the runs are made.
std::string question(const PlannedRuns& plan);

/// The verdict of a round with its names: `tied: coulomb_friction or load_torque`.
std::string answer_of(const InvestigationRound& round);

}  // namespace emtb
