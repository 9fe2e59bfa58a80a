#pragma once

#include <string>
#include <vector>

#include "analysis/diagnose/next_experiment.h"
#include "analysis/investigate/planned_runs.h"
#include "experiment/profile.h"
#include "hal/signal.h"
#include "session/session.h"

namespace emtb {

/// Runs that were recorded, under the name by which they can be had again: a session's file.
struct Recording {
  std::string name;
  std::vector<Run> runs;
};

/// The runs of all of them.
std::vector<Run> runs_of(const std::vector<Recording>& recordings);

/// A bench that makes the runs of an investigation: one at the other end of a socket, or a simulated one in a test.
class ExperimentBench {
 public:
  virtual ~ExperimentBench() = default;

  /// Which references it allows, how long, and the limits that no run is to come near.
  virtual Reach reach() const = 0;

  /// Whether it is wired to record that signal.
  virtual bool measures(Signal signal) const = 0;

  /// Asked before each lot of runs, for they move a motor. @return false where nobody wants them
  /// @throws Error where there is nobody to ask.
  virtual bool agrees(const PlannedRuns& plan) = 0;

  /// Whether somebody wants no further run: looked at before each.
  virtual bool stop_wanted() const = 0;

  /// Runs a profile and waits for its end.
  /// @param purpose for the session's note
  /// @throws Error where it is refused or does not end as planned: a fault, a stop.
  virtual Recording run(const Profile& profile, const std::string& purpose) = 0;
};

}  // namespace emtb
