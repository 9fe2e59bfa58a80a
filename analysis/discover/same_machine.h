#pragma once

#include <span>
#include <string>
#include <vector>

#include "analysis/discover/missing_torque.h"
#include "analysis/record/record.h"
#include "model/model.h"

namespace emtb {

/// A parameter that is another one in one run.
struct Changed {
  std::string run, parameter, unit;
  double from = 0;       ///< as the other runs have it
  double to = 0;         ///< as this run has it
  double std_error = 0;  ///< of the difference: of this run, and between the others
};

/// Parameters that differ in a run. Needs four runs.
///
/// Each run in turn is left out of the fit; then one parameter at a time is fitted to it alone, the others as the rest
/// of the runs have them. What differs by more than three standard errors, between-run scatter included, and by 3 %,
/// and takes a tenth of the run's excess away, is told: of each run the one parameter that takes most.
std::vector<Changed> changed_runs(std::span<const Record> records, const Model& fitted);

/// A torque that acted within a stretch of a run.
struct Disturbance {
  std::string run;
  double from_s = 0, to_s = 0;
  double torque = 0;  ///< [N m] mean over the stretch; it accelerates
};

/// Stretches of at most 5 % of the motion in all whose missing torque stands out by six robust standard deviations of
/// all other readings and four of its own errors, where the same speed and current recur elsewhere without it.
/// What stands out below a twentieth of the largest speed is left out: there friction turns round.
std::vector<Disturbance> disturbances_in(const WhatIsLeft& left);

/// A parameter of one session, or of one run.
struct TrendPoint {
  std::string run;
  double value = 0, std_error = 0;
};

/// A parameter over sessions, and the straight line through it.
struct Trend {
  std::string parameter, unit;
  std::vector<TrendPoint> points;
  double slope = 0, slope_error = 0;  ///< from one point to the next; the error counts the scatter between points
  bool clear = false;                 ///< slope beyond three of its errors, and 3 % in all
};

/// Each free parameter fitted to each group of records by itself, what the groups cannot tell alone held at the value
/// of all. @param names one a group @throws ModelError where a group cannot be simulated.
std::vector<Trend> trends(std::span<const std::vector<Record>> groups, const std::vector<std::string>& names,
                          const Model& fitted);

}  // namespace emtb
