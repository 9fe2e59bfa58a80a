#pragma once

#include <span>

#include "analysis/fit/calibrate.h"
#include "analysis/record/dataset.h"
#include "model/model.h"

namespace emtb {

/// When the inputs of these runs act, as the readings around their changes tell: loggers read a row before they write
/// its reference, or after, and stamp either; and a voltage that was set, not measured, holds from row to row. Where
/// nothing tells it, as recorded: each row is read before it is written.
///
/// Each possibility is judged by the sum of squares that it leaves, with what the free parameters take of it by their
/// sensitivities projected off. Within one sample only: what is later is a delay of the driver, an effect, and where
/// the model has an effect that shapes the driver's edges, that alone says how late they come.
///
/// A card reads one channel after the other, and some loggers a sensor from the row before: by which part of a sample
/// an instrument is behind the others is found likewise, but for those of which an effect of the model says how they
/// read.
/// @param fitted to these records
Timing fitted_timing(std::span<const Record> records, const Model& fitted);

/// As the runs were recorded: what was taken out of them and what they told themselves, which no fit changes.
Timing timing_as_recorded(const Timing& timing);

/// How far a timing is from that before: `slight` where only instruments are read a little earlier or later, by less
/// than a tenth of a sample, or a gauge whose torque loads the shaft as it was read. That bends no fit, but what is
/// left of a good one.
enum class TimingChange { none, slight, other };

/// Finds the timing and sets it.
TimingChange settle_timing(Dataset& data, const Model& fitted);

/// Sets the timing and the starts that a model tells as it stands: a start that is off looks like another timing, and
/// starts are told anew beside that.
void settle_as_it_stands(Dataset& data, const Model& model);

/// Calibrates on the training runs, and once more where that tells another timing or another start, or a motor that
/// needs shorter steps. What leaves least stands, with its timing and starts, and never leaves more than the model as
/// it is given.
Calibration calibrate(Dataset& data, const Model& model, const CalibrationOptions& options = {});

}  // namespace emtb
