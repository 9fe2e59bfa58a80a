#pragma once

#include <map>
#include <string>
#include <vector>

#include "hal/signal.h"

namespace emtb {

/// A parameter, or an effect that the model lacks, which would explain what is left.
struct LiveSuspect {
  std::string name;  ///< `R_a`, `coulomb_friction.T_c`
  std::string unit;
  double change = 0;     ///< SI, more than before; of an effect that the model lacks: its size
  double std_error = 0;  ///< SI
  double score = 0;      ///< standard errors
};

/// The motor is not any more what the run so far showed.
struct LiveChange {
  double since = 0;    ///< [s] from the start of the run, when it first showed
  double noticed = 0;  ///< [s]
  double omega = 0;    ///< [rad/s] where it shows
  double i_a = 0;      ///< [A]
  /// The best first; those behind it explain it about as well. None: nothing that is looked for explains it.
  std::vector<LiveSuspect> suspects;
};

/// How far signals are from the model over one range of speed or current.
struct LiveBin {
  Signal against{};                     ///< omega or i_a
  double from = 0, to = 0;              ///< SI
  std::map<Signal, double> normalised;  ///< RMS in units of the noise floor: 1 where the model is right
};

/// Where the model fails, and what the last seconds point to.
struct LiveMisfitReport {
  bool watching = false;               ///< enough has been seen to tell a change
  double score = 0;                    ///< standard errors, of what most looks like a change now
  std::vector<LiveChange> changes;     ///< the last few that were noticed, oldest first
  std::vector<LiveSuspect> points_to;  ///< effects that the model lacks, the best first
  std::vector<LiveBin> where;
};

/// A change as a sentence: `since 12.4 s the motor needs 0.020 +- 0.002 N m more than before: a brake left on? ...`
std::string describe(const LiveChange& change);

}  // namespace emtb
