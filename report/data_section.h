#pragma once

#include "analysis/diagnose/compare.h"
#include "analysis/diagnose/diagnose.h"
#include "report/page.h"
#include "report/report_input.h"

namespace emtb {

/// The sections of a report that tell of its runs and files.

/// Signals that some run lacks, and what each would give; nothing where none is lacking.
void signals_lacking(Page& page, const ReportInput& input);

/// The recordings as they are.
/// @param used by an analysis, which the captions then say
void raw_figures(Page& page, const ReportInput& input, bool used);

/// Noise floors, what became of the readings, the recordings.
void data_section(Page& page, const ReportInput& input, const Dataset& data);

/// Program, command, files and models.
/// @param diagnosis null where there is none
void repeat_section(Page& page, const ReportInput& input, const Diagnosis* diagnosis);

}  // namespace emtb
