#pragma once

#include <cstddef>

#include "experiment/profile.h"
#include "model/model.h"
#include "report/page.h"

namespace emtb {

/// What an effect of typical size would leave of a model that lacks it: a run of both is simulated without noise, the
/// model is fitted to it, and the speed and all residuals are drawn. So it shows what no other parameter can imitate.
/// @param model without the effect; what the effect needs is added to it
/// @throws ModelError where the simulation is not finite, or where the run shows nothing of the effect: it says why.
NamedFigure effect_picture(std::size_t effect, const Model& model, const Profile& profile);

}  // namespace emtb
