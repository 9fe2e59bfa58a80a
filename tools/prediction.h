#pragma once

#include "experiment/profile.h"
#include "model/model.h"
#include "session/session.h"

namespace emtb {

/// What a model says that a run of this profile will read: u_ref, e_a, i_a, omega, theta, torque at a fixed rate.
/// @param rate [Hz]
/// @throws ModelError where the model is not driven by u_ref, or its simulation is not finite.
Session prediction(const Model& model, const Profile& profile, double rate);

}  // namespace emtb
