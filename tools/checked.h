#pragma once

#include <optional>
#include <ostream>
#include <vector>

#include "model/model.h"
#include "session/session.h"

namespace emtb {

/// Runs that a model is fitted to, and those that judge.
struct CheckedRuns {
  std::vector<Run> train, held_out;
};

/// Looks at recordings before anything is fitted to them, and says what it found, a line a finding; what is left is
/// split where nothing was recorded (session/gaps.h).
/// @param unchecked does not look
/// @return nothing where a finding makes a fit meaningless; what to do about it is said, too
std::optional<CheckedRuns> checked(const CheckedRuns& given, const Model& model, bool unchecked, std::ostream& say);

/// What `--unchecked` does, for help.
inline constexpr const char* unchecked_help = "goes on where the recordings contradict themselves: see emtb check";

}  // namespace emtb
