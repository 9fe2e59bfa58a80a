#pragma once

#include <string>

#include "analysis/diagnose/diagnose.h"
#include "report/page.h"
#include "report/report_input.h"

namespace emtb {

/// The whole report of a diagnosis.
Page report_page(const ReportInput& input, const Diagnosis& diagnosis);

/// The report where the analysis refused: why, what is lacking, and the recordings as they are.
Page refusal_page(const ReportInput& input, const std::string& why);

/// @param option that named the file
/// @throws Error where it cannot be written.
void write_page(const std::string& file, const Page& page, const std::string& option = "--out");

}  // namespace emtb
