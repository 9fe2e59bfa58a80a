#pragma once

#include <optional>
#include <string>
#include <vector>

#include "experiment/profile.h"

namespace emtb {

/// What must be so before an experiment begins.
struct Needs {
  bool at_rest = false;                 ///< the motor stands
  bool field = false;                   ///< the field is proved by i_f
  std::optional<double> idle{};         ///< [min] without a run before: windings and bearings are cold
  std::optional<double> temperature{};  ///< [degC] at most
};

/// A place in a profile where a person has something to do. The reference is held, and the profile's time with it.
struct Pause {
  double at = 0;       ///< [s] of the profile
  std::string say;     ///< `set the brake to 0.2 N m`
  double within = 60;  ///< [s] without a confirmation: the run ends
};

/// A profile, and what surrounds it when it is run on a bench.
struct Experiment {
  Profile profile;
  Needs needs{};
  std::vector<Pause> pauses{};  ///< in the order of time

  /// [s] with every pause as long as it may be
  double longest() const {
    double t = profile.duration();
    for (const Pause& pause : pauses) t += pause.within;
    return t;
  }
};

}  // namespace emtb
