#pragma once

namespace emtb {

/// What is the same in the C source of every FMU: types of the standard 2.0, then its functions. Between the two stands
/// what depends on the model: `place()` and `may_set()` of a variable, GUID.
extern const char* const fmu_source_head;
extern const char* const fmu_source_functions;

}  // namespace emtb
