#pragma once

#include "analysis/check/balance.h"
#include "analysis/check/finding.h"
#include "model/model.h"

namespace emtb {

/// Factors of a unit that the gauge of torque contradicts, since K_b = K_m in SI, or that the model's bounds do.
/// @param model null: none was given
DataFindings wrong_scales(const MotionWindows& windows, const MotorBalance& balance, const Model* model);

/// Whether anything but the numbers themselves says what scale the speed has: else one remark.
DataFindings unfixed_scale(const MotionWindows& windows, const MotorBalance& balance);

}  // namespace emtb
