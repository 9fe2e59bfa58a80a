#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "session/session.h"

namespace emtb {

/// A stretch of a run, [s] from its start.
struct Stretch {
  std::string run = {};
  double from = 0, to = 0;
};

/// What an analysis does not use, and why.
struct LeftOut {
  Stretch where = {};
  std::string why = {};
};

inline constexpr double time_rounding = 1e-9;  ///< [s] two times are the same: they are sums of many intervals

/// The mean of a signal over a stretch of time.
struct Mean {
  double value = 0;
  /// From the scatter and its autocorrelation; from the instrument's step where nothing scatters.
  double std_error = 0;
  std::size_t readings = 0;
};

/// Mean and standard error of readings that follow each other. No readings: nothing.
/// @param lsb step of the instrument; 0: unknown
Mean mean_of(std::span<const double> x, double lsb);

/// The mean of a signal's readings that fall wholly into a stretch: a slow meter's reading counts where its window lies
/// in it. No readings: nothing.
Mean mean_over(const Series& series, double from, double to);

/// A least-squares line through the readings of a stretch: value at its middle, slope, and their standard errors.
struct LocalLine {
  double value = 0, value_error = 0;
  double slope = 0, slope_error = 0;
  std::size_t readings = 0;
};
LocalLine local_line(const Series& series, double from, double to);

/// The largest size of a signal, whatever its sign; 0 of nothing.
double largest_size(const Series& series);

/// The stretches of a run in which `armature_open` is 1.
std::vector<Stretch> open_armature(const Run& run);

/// The instrument's step, as the session states it or as the readings show it; 0: neither.
double lsb_of(const Series& series);

/// [s] over which each reading of a signal averages: as the session states it; of a slow meter that states none, since
/// the reading before; of others 0.
double averaging_window(const Run& run, Signal signal);

}  // namespace emtb
