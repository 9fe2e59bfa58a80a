#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "session/session.h"

namespace emtb::page {

using json = nlohmann::json;

/// With seven digits, which is more than a screen shows; null for what is no number.
json number(double value);
json numbers(std::span<const double> values);

/// Readings of part of a run, as many as a plot shows.
struct Window {
  double from = 0, to = 0;   ///< [s]
  std::size_t points = 900;  ///< bins at most

  /// What a request says. @param duration [s] of the run
  static Window of(const json& params, double duration);
};

/// For each bin of a window the readings [first, last) that are in it; where there are few, each by itself.
struct Bins {
  bool single = true;  ///< each holds one reading
  std::vector<double> t;
  std::vector<std::size_t> first, last;
};
Bins bins_of(std::span<const double> t, const Window& window);

json least(const Bins& bins, std::span<const double> values);
json largest(const Bins& bins, std::span<const double> values);
json mean(const Bins& bins, std::span<const double> values);

/// `{"t", "min", "max"}` or `{"t", "value"}`.
json binned(const Series& series, const Window& window);

/// All signals of a run so, each with its unit.
json binned(const Run& run, const Window& window);

}  // namespace emtb::page
