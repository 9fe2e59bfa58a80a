#pragma once

#include <span>
#include <string>
#include <vector>

#include "analysis/record/record.h"
#include "model/model.h"

namespace emtb {

/// What the equations lack, recovered from the data without naming an effect: a torque or a voltage as a curve.
struct MissingCurve {
  std::string quantity;  ///< "torque" (it accelerates) or "voltage" (added to the terminals)
  std::string unit;
  std::string against;  ///< "omega" or "i_a"
  std::string against_unit;
  std::vector<double> x, value, std_error;
};

/// The torque over the speed, and where a current was measured the voltage over the current, that a fitted model lacks
/// on these records.
///
/// The equations get a curve through knots that the data's range spans, one side for each direction, since friction
/// jumps at standstill. Its values follow by linear least squares from the residuals and the sensitivities at no curve
/// at all, together with changes of the base parameters, but for the one that a straight line would imitate: B stays
/// for the torque, R_a for the voltage, and so do the effects. The curve is what is missing beside them as they stand.
/// Standard errors hold for coloured residuals (blocks of a second). A curve that is not there is zero within its band.
std::vector<MissingCurve> missing_curves(std::span<const Record> records, const Model& fitted);

}  // namespace emtb
