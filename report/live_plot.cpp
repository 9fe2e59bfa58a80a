#include "report/live_plot.h"

#include <algorithm>
#include <cmath>

namespace emtb {

void LivePlot::add(double t, double omega, double i_a) {
  readings_.push_back({t, omega, i_a});
  while (readings_.front().t < t - seconds_) readings_.pop_front();
}

std::string LivePlot::text(const TerminalStyle& style) const {
  std::vector<double> t, omega, i_a;
  for (const Reading& r : readings_) {
    t.push_back(r.t - readings_.back().t);
    omega.push_back(r.omega);
    i_a.push_back(r.i_a);
  }
  const auto measured = [](const std::vector<double>& y) {
    return std::ranges::any_of(y, [](double v) { return std::isfinite(v); });
  };
  Figure figure;
  figure.x({.label = "time", .unit = "s", .min = -seconds_, .max = 0});
  if (measured(omega)) figure.panel({"ω", "rad/s"}, 170).line("", t, omega, {Ink::blue});
  if (measured(i_a)) figure.panel({"i_{a}", "A"}, 120).line("", t, i_a, {Ink::vermilion});
  return figure.panels.empty() ? "" : to_terminal(figure, style);
}

}  // namespace emtb
