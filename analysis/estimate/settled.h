#pragma once

#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "hal/signal.h"
#include "session/session.h"

namespace emtb {

/// The mean of a signal over a stretch of time.
struct Mean {
  double value = 0;
  double std_error =
      0;  ///< from the scatter and its autocorrelation; from the instrument's step where nothing scatters
  std::size_t readings = 0;
};

/// A stretch of a run, [s] from its start.
struct Stretch {
  std::string run = {};
  double from = 0, to = 0;
};

/// A stretch in which nothing changes: one point of a static characteristic.
struct SettledPoint {
  Stretch where = {};
  std::map<Signal, Mean> mean = {};  ///< of each signal that was read in it

  bool has(Signal signal) const { return mean.contains(signal); }
  double at(Signal signal) const { return mean.at(signal).value; }
  double error(Signal signal) const { return mean.at(signal).std_error; }
};

/// What an analysis does not use, and why.
struct LeftOut {
  Stretch where = {};
  std::string why = {};
};

struct Settled {
  std::vector<SettledPoint> points = {};
  std::vector<LeftOut> left_out = {};
};

struct SettledOptions {
  double shortest = 1;                                 ///< [s] of a stretch that is found
  std::vector<std::pair<double, double>> chosen = {};  ///< [s] these stretches of every run, instead of looking for any
};

/// The mean of a signal's readings that fall wholly into a stretch: a slow meter's reading counts where its window lies
/// in it. No readings: nothing.
Mean mean_over(const Series& series, double from, double to);

/// Finds the stretches in which u_ref, e_a, omega and torque stand still, and averages every signal over them.
///
/// A run is cut into cells of 0.25 s. Neighbours belong together where no signal's mean moves by more than its scatter
/// explains (4 sigma), or 0.05 % of the signal's largest value. A stretch loses its first cell, where what it settles
/// from may still die away, and its last, in which the next change may begin.
/// @throws SessionError where a chosen stretch lies in no run.
Settled settled_points(std::span<const Run> runs, const SettledOptions& options = {});

}  // namespace emtb
