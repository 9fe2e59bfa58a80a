#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "analysis/discover/missing_torque.h"

namespace emtb {

/// How much of what is left one quantity explains, on runs left out; 1 is all of it, below 0 is worse than nothing.
struct Share {
  double alone = 0;      ///< by a smooth function of this quantity alone
  double only = 0;       ///< what is lost from all of them together without this one
  double std_error = 0;  ///< of `alone`, from run to run
};

/// The shares of what is left, of the torque or of the voltage.
struct Shares {
  double rms = 0;                   ///< N m or V
  std::map<std::string, Share> of;  ///< omega, i_a, acceleration, theta, t, u_ref, direction; `omega and i_a`, where
                                    ///< the two together say more than two curves do
  double together = 0;              ///< a sum of smooth functions of all
  double ceiling = 0;               ///< the best of any one and of all together: what no law can exceed
};

/// What part of the missing torque (or voltage) is a smooth function of which quantity.
///
/// Each quantity gets a curve through twelve knots with a penalty on its bends, the angle a Fourier series up to order
/// 12, each fitted jointly with straight lines in speed, current and acceleration, which belong to the parameters of
/// the base model and explain nothing. Each run (of a single one each fifth) is left out in turn, and the share is
/// counted on it alone: what agrees with nothing but its own run explains nothing. Readings at rest are left out, where
/// friction is an inequality. The speed is asked together with current, acceleration, time and reference as well, by a
/// surface through six knots of each; `only` is then what it explains beyond a curve of either. The strength of the
/// penalty is the best of four on the runs left out.
Shares shares_of(const WhatIsLeft& left, bool voltage);

}  // namespace emtb
