#pragma once

#include <string>

#include "analysis/diagnose/diagnose.h"
#include "report/page.h"
#include "report/report_input.h"

namespace emtb {

/// What to do next, by the verdict and by what the runs leave open, with the command where there is one.
void next_steps(Page& page, const ReportInput& input, const Diagnosis& diagnosis);

/// Parameters that only move together, as printed: `−0.12 K_{b} +0.99 B`; one on its own without its factor.
std::string combination(const Undetermined& undetermined);

}  // namespace emtb
