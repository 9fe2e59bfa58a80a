#pragma once

#include <span>

#include "model/model.h"
#include "session/session.h"

namespace emtb {

/// [s] When the reference of a row acts, relative to the readings of that row, as a fast reading of the terminals tells
/// by itself: a row is read before its reference is written (0, also where nothing tells it), after (negative, as good
/// as nothing), or the reference acts a row later (a sample). Where the driver moves slowly enough to tell and nearly
/// nothing is left then, amid a row: one of the two instruments is late by less. Half a sample of difference between
/// the voltage that is thought to drive a motor and the one that does would show as a late speed, and as another
/// resistance.
///
/// Judged by what the driver's model leaves of the changes from reading to reading: what is slow cancels.
/// @param runs of one file or set, logged alike
double reference_acts_after(std::span<const Run> runs, const Model& model);

/// By how many rows the reading of the terminals is behind that of the current, 0 or 1: an instrument that is read late
/// within its row shows a jump a row later than one that is not. As the changes of both from row to row tell.
int rows_voltage_is_late(std::span<const Run> runs, const Model& model);

/// Is a signal read anew at the times of the model's input, all of them? Elsewhere there is nothing to compare row by
/// row.
bool read_in_every_row(const Run& run, Signal signal, const Model& model);

/// Does a reading of the terminals come often enough to drive a simulation of this run?
bool drives_the_motor(const Run& run, const Model& model);

}  // namespace emtb
