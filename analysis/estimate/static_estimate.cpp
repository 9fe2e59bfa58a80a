#include "analysis/estimate/static_estimate.h"

#include <algorithm>
#include <cmath>

#include "hal/error.h"

namespace emtb {

StaticExperiment experiment_of(StaticMethod method) {
  switch (method) {
    case StaticMethod::equation_6:
    case StaticMethod::armature:
      return StaticExperiment::resistance;
    case StaticMethod::generator:
      return StaticExperiment::generator;
    case StaticMethod::load_line:
    case StaticMethod::friction:
      return StaticExperiment::friction;
    case StaticMethod::torque_constant:
      return StaticExperiment::torque_constant;
    case StaticMethod::switch_on:
    case StaticMethod::acceleration:
    case StaticMethod::whole_run:
      return StaticExperiment::inertia;
    case StaticMethod::coast_down:
      return StaticExperiment::coast_down;
    case StaticMethod::driver_gain:
    case StaticMethod::driver_slopes:
      return StaticExperiment::driver;
    case StaticMethod::inverse_dynamics:
      return StaticExperiment::inverse_dynamics;
  }
  return {};
}

std::string_view name(StaticExperiment experiment) {
  constexpr std::array<std::string_view, 8> names{"resistance", "generator",  "friction", "torque-constant",
                                                  "inertia",    "coast-down", "driver",   "inverse-dynamics"};
  return names[static_cast<std::size_t>(experiment)];
}

std::string_view name(StaticMethod method) {
  constexpr std::array<std::string_view, 13> names{
      "equation_6",   "armature",  "generator",  "load_line",   "friction",      "torque_constant", "switch_on",
      "acceleration", "whole_run", "coast_down", "driver_gain", "driver_slopes", "inverse_dynamics"};
  return names[static_cast<std::size_t>(method)];
}

void EstimateSeries::add(const LinePoint& point) {
  x.push_back(point.x);
  y.push_back(point.y);
  y_error.push_back(point.sigma_y);
}

EstimateSeries curve_of(const Series& series, const Stretch& stretch, double origin) {
  constexpr std::size_t drawn = 4000;  // readings of a whole run: more than a picture has columns
  EstimateSeries shown{.name = stretch.run, .joined = true};
  const auto every = std::max<std::size_t>(1, series.t.size() / drawn);
  for (std::size_t k = 0; k < series.t.size() && series.t[k] <= stretch.to; k += every) {
    if (series.t[k] < stretch.from) continue;
    shown.x.push_back(series.t[k] - origin);
    shown.y.push_back(series.value[k]);
  }
  return shown;
}

double quotient_error(double value, double relative_a, double relative_b) {
  return std::abs(value) * std::hypot(relative_a, relative_b);
}

bool StaticEstimate::has(const std::string& symbol) const {
  return std::ranges::find(quantities, symbol, &Quantity::symbol) != quantities.end();
}

const Quantity& StaticEstimate::at(const std::string& symbol) const {
  const auto found = std::ranges::find(quantities, symbol, &Quantity::symbol);
  if (found == quantities.end()) {
    throw SessionError(std::string(name(method)) + " gives no " + symbol + (lacking.empty() ? "" : ": " + lacking));
  }
  return *found;
}

}  // namespace emtb
