#pragma once

#include <span>

#include "analysis/fit/calibrate.h"
#include "analysis/record/record.h"

namespace emtb {

/// Adds to the standard errors what is not known of the instruments' timing and of how the runs begin. Each may be read
/// behind the others by a part of a sample, whether that was found or not, and where a current decays in a few samples,
/// to read it a tenth of one later is to read less of it: R_a and J make up for that without a trace in what is left.
///
/// With D the change of the residuals by a sample of lateness of each instrument, S the sensitivities and phi by how
/// much the errors of coloured residuals exceed white ones, the parameters go with the lateness by G = (SᵀS)⁻¹SᵀD, and
/// the lateness is known to ((Dᵀ(1 - S(SᵀS)⁻¹Sᵀ)D)/phi + 12)⁻¹, the 12 being that of an even chance over a sample. What
/// is not known of the states in which runs begin that do not begin at rest is added likewise, without such a chance.
/// @param fit of these records, with standard errors
void widen_by_logging(std::span<const Record> records, Calibration& fit);

}  // namespace emtb
