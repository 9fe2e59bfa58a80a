#pragma once

#include <map>
#include <span>
#include <utility>
#include <vector>

#include "analysis/estimate/stretch.h"
#include "hal/signal.h"

namespace emtb {

/// A stretch in which nothing changes: one point of a static characteristic.
struct SettledPoint {
  Stretch where = {};
  std::map<Signal, Mean> mean = {};  ///< of each signal that was read in it

  bool has(Signal signal) const { return mean.contains(signal); }
  double at(Signal signal) const { return mean.at(signal).value; }
  double error(Signal signal) const { return mean.at(signal).std_error; }
};

struct Settled {
  std::vector<SettledPoint> points = {};
  std::vector<LeftOut> left_out = {};
};

struct SettledOptions {
  /// [s] of a stretch that is found. By hand: a slow meter (0.4 s) reads twice in it (tests/analysis/estimate/settled).
  double shortest = 1;
  std::vector<std::pair<double, double>> chosen = {};  ///< [s] these stretches of every run, instead of looking for any
};

/// Finds the stretches in which u_ref, e_a, omega and torque stand still, and averages every signal over them.
///
/// A run is cut into cells of 0.25 s. Neighbours belong together where no signal's mean moves by more than its scatter
/// explains (4 sigma), or 0.05 % of the signal's largest value. A stretch loses its first cell, where what it settles
/// from may still die away, and its last, in which the next change may begin.
/// @throws SessionError where a chosen stretch lies in no run.
Settled settled_points(std::span<const Run> runs, const SettledOptions& options = {});

/// The settled points that have all of these signals, with the armature closed. The others, and what was not settled,
/// go to `left_out` with what they lack.
std::vector<const SettledPoint*> points_with(const Settled& settled, std::span<const Signal> signals,
                                             std::vector<LeftOut>& left_out);

}  // namespace emtb
