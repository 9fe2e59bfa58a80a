#pragma once

#include "analysis/diagnose/diagnose.h"
#include "report/page.h"

namespace emtb {

/// Values of the final model beside those of the base model, what keeps each, and what the runs do not determine.
void parameter_section(Page& page, const Diagnosis& diagnosis);

}  // namespace emtb
