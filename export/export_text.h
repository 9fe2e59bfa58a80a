#pragma once

#include <string>

#include "export/equations.h"

namespace emtb {

/// The model as a header in C99 that needs math.h alone: `emtb_parameters`, `emtb_state`, `emtb_start()`,
/// `emtb_step()`.
std::string c_header(const ExportedEquations& equations);

/// The model as a function file for Octave and MATLAB. @param function its name, which must be that of the file
std::string octave_function(const ExportedEquations& equations, const std::string& function);

/// The model in Modelica. It has not been compiled: the text says so.
std::string modelica_model(const ExportedEquations& equations);

}  // namespace emtb
