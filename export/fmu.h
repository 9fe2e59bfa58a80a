#pragma once

#include <string>
#include <utility>
#include <vector>

#include "export/equations.h"

namespace emtb {

/// The model as an FMU 2.0 for co-simulation, but for what a compiler makes of it.
///
///     inputs       the reference (u_ref, e_a or i_a_ref) and load [N m]
///     outputs      omega, theta, i_a, e_a
///     parameters   those of the model, tunable
///
/// A communication step is walked in steps of a millisecond or less, with the inputs held.
struct Fmu {
  std::string identifier;  ///< of the model and its library: letters, digits and _
  /// Path within the archive and text: modelDescription.xml, sources/...
  std::vector<std::pair<std::string, std::string>> files;
  std::string source;   ///< which of them the compiler is given
  std::string library;  ///< where in the archive its shared library goes: binaries/linux64/IDENTIFIER.so
};

/// @param identifier usually the name of the file
Fmu fmu_of(const ExportedEquations& equations, const std::string& identifier);

/// A zip archive of such files, as they are given and not compressed: the same files are the same bytes.
std::string zip_archive(const std::vector<std::pair<std::string, std::string>>& files);

}  // namespace emtb
