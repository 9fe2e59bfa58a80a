#pragma once

#include <ostream>
#include <span>
#include <string>

#include "analysis/diagnose/diagnose.h"
#include "hal/error.h"
#include "model/model.h"
#include "session/session.h"

namespace emtb {

/// Looks at recordings before anything is fitted to them, and says what it found, a line a finding.
/// @param held_out runs that judge a fit to the others @param unchecked does not look
/// @return whether they may be fitted; where a finding makes that meaningless, what to do about it is said, too
bool may_be_fitted(std::span<const Run> train, std::span<const Run> held_out, const Model& model, bool unchecked,
                   std::ostream& say);

/// Readings that are far apart are those of other times than the file says, and a simulation from one to the next would
/// take all memory. @throws Error
void refuse_slow_readings(std::span<const Run> runs);

/// What a search is told beside the data.
struct SearchWords {
  std::string explain;  ///< `torque`, or nothing
  double effort = 1;

  /// @throws Error where the effort is not above 0
  DiagnoseOptions options() const;
};

/// What `--only`, `--without`, `--explain`, `--effort` and `--unchecked` do, for help.
inline constexpr const char* only_help =
    "tries these effects alone, and what they need: ids, with commas or one by one";
inline constexpr const char* without_help = "tries all but these effects";
inline constexpr const char* explain_help =
    "torque: what the gauge reads is to be explained as well; else it loads the shaft as it is";
inline constexpr const char* effort_help =
    "how long the search may go on where nothing explains what is left: 1 is some minutes; the same on any machine";
inline constexpr const char* unchecked_help =
    "goes on where the recordings contradict themselves or the model's bounds: see emtb check";

}  // namespace emtb
