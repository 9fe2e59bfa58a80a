#pragma once

#include <map>
#include <optional>

#include "experiment/profile.h"
#include "model/model.h"
#include "model/simulation.h"

namespace emtb {

/// A run that was never made.
struct Foreseen {
  Excitation excitation;
  Trajectory<double> readings;
};

/// What a model says of a run of this profile, from standstill.
/// @param interval [s] between readings
/// @return nothing where the simulation is not finite
/// @throws ModelError where the model is not driven by u_ref.
std::optional<Foreseen> foresee(const Model& model, const Profile& profile, double interval);

/// Magnitudes at which a bench ends a run: |i_a| [A], |omega| [rad/s], |torque| [N m].
using SignalLimits = std::map<Signal, double>;

/// The profile, or where a model foresees that it would come close to a limit, one of the same shape with smaller
/// levels.
/// @param share of each limit that may be used; the rest is for what the model does not know
/// @return nothing where no tenth of it would do
std::optional<Profile> within_limits(const Profile& profile, const Model& model, const SignalLimits& limits,
                                     double share = 0.8);

}  // namespace emtb
