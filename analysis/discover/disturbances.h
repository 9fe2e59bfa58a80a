#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "analysis/discover/missing_torque.h"
#include "session/session.h"

namespace emtb {

/// A torque that acted within a stretch of a run.
struct Disturbance {
  std::string run;
  double from_s = 0, to_s = 0;
  double torque = 0;  ///< [N m] mean over the stretch, beside what is missing elsewhere; it accelerates
};

/// Stretches of at most 5 % of the motion in all, four at most, whose missing torque stands out, where the same speed
/// and current come elsewhere without it.
///
/// What is missing at a speed and current is the median of all intervals like it, within a tenth of the ranges, that
/// are not near it in time. A load that is large enough brings a speed together with a current that come together
/// nowhere else: then what is missing at the one, and beside that at the other. An interval stands out by six robust
/// standard deviations of how intervals are off that median, of all of them, of those like it and of its run, and by
/// four of its own errors; and at least half of what it is off is missing in it, not in those like it. A stretch is
/// five intervals or more that stand out, reaches as far as they are off by two standard deviations, or where nothing
/// is like them lack half as much, and its mean is a fiftieth or more of what drives the motor. As many intervals like
/// it, or twenty, must come elsewhere without it: else it may be a law. The strongest is found first; the others are
/// held against what is usual without it, and what has less than a tenth of its impulse is none.
std::vector<Disturbance> disturbances_in(const WhatIsLeft& left);

/// The runs without the stretches: what is before and behind one becomes a run of its own, with a state of its own to
/// start from. Pieces of less than a tenth of their run, or of fewer than fifty readings, are dropped.
/// @param input that drives the model
std::vector<Run> without_disturbances(std::span<const Run> runs, std::span<const Disturbance> disturbances,
                                      Signal input);

/// Is a run of that name the disturbed run, or what without_disturbances() left of it?
bool is_of_disturbed_run(std::string_view name, const Disturbance& disturbance);

}  // namespace emtb
