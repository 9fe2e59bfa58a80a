#pragma once

#include <span>

#include "model/model.h"
#include "session/session.h"

namespace emtb {

/// By which part of a row the terminals are read behind the other instruments, 0 to 1. A card that reads one channel
/// after the other, or a meter that is slower, tells an edge of a driver that takes its time by so much later; the
/// motor does not wait for it.
///
/// That the voltage is read amid an edge says reference_acts_after(); which of the two is late, the motor: a current
/// changes as the voltage does, but for what the speed takes of it meanwhile, and so does the acceleration,
///
///     di = c_0 + c_1 de + c_2 i        dω = c_0 + c_1 e + c_2 ω.
///
/// For each part of a row by which the edges may come earlier than the terminals show them, the least squares of these
/// say what is left. Nothing is read before it happens: of the signals that tell, the one that tells the earliest.
/// @param acts_after [s] as the terminals tell
/// @param runs of one file or set, logged alike
double terminals_are_late(std::span<const Run> runs, const Model& model, double acts_after);

/// By which part of a row the edges of a quick driver come before its terminals are read at their new voltage, 0 to 1:
/// all of it where a log holds the reference that was in force until its row. The terminals tell no more than the row
/// in which an edge falls; the motion tells when, by the equation above.
/// @param acts_after [s] as the terminals tell; only where that is with a row can it be so
double edges_come_early(std::span<const Run> runs, const Model& model, double acts_after);

}  // namespace emtb
