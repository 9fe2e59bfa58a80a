#pragma once

#include <deque>
#include <string>

#include "figures/terminal.h"

namespace emtb {

/// Speed and armature current of the last seconds, drawn anew with each reading: `emtb watch --plot`.
class LivePlot {
 public:
  explicit LivePlot(double seconds) : seconds_(seconds) {}

  /// @param t [s], increasing; NaN where a signal is not measured
  void add(double t, double omega, double i_a);

  /// The plot, time counted back from the latest reading.
  std::string text(const TerminalStyle& style) const;

 private:
  struct Reading {
    double t, omega, i_a;
  };
  double seconds_;
  std::deque<Reading> readings_;
};

}  // namespace emtb
