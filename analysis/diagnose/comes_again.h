#pragma once

#include <map>
#include <span>
#include <vector>

#include "analysis/diagnose/conditions.h"
#include "analysis/diagnose/likelihood.h"
#include "analysis/record/record.h"
#include "hal/signal.h"
#include "model/model.h"

namespace emtb {

/// Does what a model leaves of a signal come again, from run to run and from piece to piece, as a function of speed,
/// current, direction, angle or the like? Then it is a law that the model lacks; a disturbance of its own is none.
///
/// With s_pb the sum of the residuals of piece p within bin b of a condition, and N_b the readings in it, what all
/// pieces have in common takes the share  sum_b ((sum_p s_pb)^2 - sum_p s_pb^2)/N_b  of the sum of squares: nothing in
/// the mean where each piece goes its own way. Whether it is more than chance shows when pieces change their signs at
/// random (a randomisation test, as Winkler et al. 2014 describe them): the largest share over all conditions is held
/// against the largest of each draw, so that many conditions are no more chances.
struct ComingAgain {
  double share = 0;   ///< of the mean square of what is left, for the condition of the largest
  double chance = 1;  ///< of pieces of random signs to show as much
};

/// @param readings of one signal, with the numbers of pieces whose residuals are independent
ComingAgain coming_again(const ReadingsByCondition& readings);

/// Of each signal. @param memory of what is left of it; none is known: it forgets at once
std::map<Signal, ComingAgain> coming_again(const RecordRefs& records, const Model& model, const Memories& memory);

}  // namespace emtb
