#pragma once

#include "session/session.h"

namespace emtb {

/// Where the log of a slow meter, kept by another program with a clock of its own, belongs in a recorded run:
///
///     t = t_log + offset + drift (t_log - middle)
struct LogAlignment {
  double offset = 0, offset_error = 0;  ///< [s] in the middle of the log; standard error
  double drift = 0, drift_error = 0;  ///< by which the log's clock runs slow; error 0: it cannot be told, and is left 0
  double middle = 0;                  ///< [s] on the log's clock
  double explained = 0;               ///< share of the log's variance that the run explains there
  double runner_up = 0;               ///< the same at the best other place; 0: there is none

  double time(double t_log) const { return t_log + offset + drift * (t_log - middle); }
};

/// Finds the place by what a current owes to the rest of the run,
///
///     i_a = c_0 + c_1 ω + c_2 dω/dt + c_3 sign ω + c_4 e_a
///
/// (the torque balance, and the armature's voltage where it was recorded), each a mean over the reading's own window.
/// The multiple correlation of the log with these is looked at for every offset at which three fifths of the shorter of
/// both overlap, then for every drift of two clocks; standard errors are those of the sum of squares about its least,
/// and of the offset at least a twentieth of a window: standing friction and heating, which the balance lacks, shift
/// it. A delay of the meter is part of the offset.
/// @param run has omega or e_a
/// @param log of i_a; without a window, each reading is the mean since the one before
/// @throws SessionError where too little is there, nothing varies, the log does not look like the run, or more than one
/// place fits
LogAlignment align_log(const Run& run, const Series& log);

/// The log's readings at their places in the run; those outside it are left out.
Series placed(const Run& run, const Series& log, const LogAlignment& at);

}  // namespace emtb
