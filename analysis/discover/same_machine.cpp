#include "analysis/discover/same_machine.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "analysis/fit/calibrate.h"
#include "analysis/numerics/parallel.h"
#include "analysis/numerics/regression.h"
#include "analysis/numerics/statistics.h"
#include "hal/error.h"

namespace emtb {
namespace {

/// One parameter of one run, the others as they are.
struct Alone {
  double value = 0, std_error = std::numeric_limits<double>::infinity();
  double squares_before = 0, squares_after = 0, readings = 0;
};

Alone one_parameter(std::span<const Record> run, Model model, std::size_t place) {
  for (std::size_t i = 0; i < model.names().size(); ++i) {
    if (i != place) model.at(i).fixed = true;
  }
  const std::vector<Residuals> before = residuals(run, model, model.values(), {});
  Alone found;
  found.value = model.at(place).value;
  found.squares_before = found.squares_after = sum_of_squares(before);
  for (const Residuals& r : before) found.readings += static_cast<double>(r.value.size());
  try {
    const Calibration c = calibrate(
        run, model,
        {.extra_starts = 0, .max_iterations = 12, .tolerance = 1e-5, .with_covariance = true, .quick_errors = true});
    found.value = c.model.at(place).value;
    if (c.model.at(place).std_error) found.std_error = *c.model.at(place).std_error;
    found.squares_after = sum_of_squares(residuals(run, c.model, c.model.values(), {}));
  } catch (const ModelError&) {
    return found;
  }
  return found;
}

Changed most_changed(std::span<const Record> records, std::size_t r, const Model& fitted) {
  constexpr double errors = 3, least = 0.03, share = 0.1;
  std::vector<Record> rest(records.begin(), records.end());
  rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(r));
  const Model others =
      calibrate(rest, fitted, {.extra_starts = 0, .max_iterations = 25, .tolerance = 1e-6, .with_covariance = false})
          .model;
  Changed best;
  double most = 0;
  const FreeParameters free(others);
  for (const std::size_t place : free.places()) {
    const Alone own = one_parameter(records.subspan(r, 1), others, place);
    const double from = others.at(place).value, off = own.value - from;
    const double excess = std::max(0.0, own.squares_before - own.readings);
    const double gone = own.squares_before - own.squares_after;
    const bool counts = gone > share * excess && gone > 0.1 * own.readings;
    if (!counts || gone <= most || std::abs(off) < least * std::abs(from)) continue;
    if (std::abs(off) < errors * own.std_error) continue;  // before the others are asked, which takes longer
    double between = 0;
    for (std::size_t s = 0; s < rest.size(); ++s) {
      const double d = one_parameter(std::span(rest).subspan(s, 1), others, place).value - from;
      between += d * d / static_cast<double>(rest.size() - 1);
    }
    const double error = std::sqrt(own.std_error * own.std_error + between);
    if (std::abs(off) < errors * error) continue;
    most = gone;
    best = {records[r].name, others.names()[place], others.at(place).unit, from, own.value, error};
  }
  return best;
}

/// A stretch of one run in which the missing torque stands out.
struct Stretch {
  std::size_t run = 0, begin = 0, end = 0;
};

}  // namespace

std::vector<Changed> changed_runs(std::span<const Record> records, const Model& fitted) {
  constexpr std::size_t fewest = 4;
  if (records.size() < fewest) return {};
  std::vector<Changed> all(records.size()), changed;
  each_on_a_core(records.size(), [&](std::size_t r) {
    try {
      all[r] = most_changed(records, r, fitted);
    } catch (const ModelError&) {
      all[r] = {};  // the others cannot be simulated without it: nothing is told
    }
  });
  for (Changed& c : all) {
    if (!c.parameter.empty()) changed.push_back(std::move(c));
  }
  return changed;
}

std::vector<Disturbance> disturbances_in(const WhatIsLeft& left) {
  constexpr double scatters = 6, errors = 4, most = 0.05, near = 0.1, at_rest = 0.05;
  std::vector<double> sizes;
  double fastest = 0, largest = 0, moving = 0;
  for (const MissingTorque& run : left.runs) {
    for (std::size_t k = 0; k < run.t.size(); ++k) {
      sizes.push_back(std::abs(run.torque[k]));
      fastest = std::max(fastest, std::abs(run.omega[k]));
      largest = std::max(largest, std::abs(run.i_a[k]));
    }
  }
  if (sizes.empty()) return {};
  const double limit = scatters * robust_sigma(sizes);
  const auto out = [&](const MissingTorque& run, std::size_t k) {
    return std::abs(run.torque[k]) > std::max(limit, errors * run.torque_error[k]);
  };
  std::vector<Stretch> stretches;
  for (std::size_t r = 0; r < left.runs.size(); ++r) {
    const MissingTorque& run = left.runs[r];
    for (std::size_t k = 0; k < run.t.size(); ++k) {
      moving += 1;
      if (!out(run, k)) continue;
      if (!stretches.empty() && stretches.back().run == r && k <= stretches.back().end + 2) {
        stretches.back().end = k;
      } else {
        stretches.push_back({r, k, k});
      }
    }
  }
  double cut = 0;
  std::vector<Disturbance> found;
  for (const Stretch& s : stretches) {
    const MissingTorque& run = left.runs[s.run];
    const auto n = static_cast<double>(s.end - s.begin + 1);
    if (n < 5) continue;
    cut += n;
    double speed = 0, current = 0, torque = 0, slowest = fastest;
    for (std::size_t k = s.begin; k <= s.end; ++k) {
      slowest = std::min(slowest, std::abs(run.omega[k]));
      speed += run.omega[k] / n;
      current += run.i_a[k] / n;
      torque += run.torque[k] / n;
    }
    if (slowest < at_rest * fastest) continue;  // where friction turns round, any small error is a torque
    double like = 0;
    for (std::size_t r = 0; r < left.runs.size(); ++r) {
      const MissingTorque& other = left.runs[r];
      for (std::size_t k = 0; k < other.t.size(); ++k) {
        const bool own = r == s.run && k + 5 >= s.begin && k <= s.end + 5;
        const bool same =
            std::abs(other.omega[k] - speed) < near * fastest && std::abs(other.i_a[k] - current) < near * largest;
        if (!own && same && !out(other, k)) like += 1;
      }
    }
    if (like < n) continue;  // its states come nowhere else: it may be a law
    found.push_back({run.run, run.t[s.begin], run.t[s.end], torque});
  }
  if (cut > most * moving) return {};
  return found;
}

std::vector<Trend> trends(std::span<const std::vector<Record>> groups, const std::vector<std::string>& names,
                          const Model& fitted) {
  constexpr double errors = 3, least = 0.03;
  const FreeParameters free(fitted);
  std::vector<Trend> all(free.size());
  std::vector<Calibration> fits(groups.size());
  each_on_a_core(groups.size(), [&](std::size_t g) {
    fits[g] = calibrate(groups[g], fitted, {.extra_starts = 0, .max_iterations = 40, .tolerance = 1e-7});
  });
  for (std::size_t i = 0; i < free.size(); ++i) {
    Trend& t = all[i];
    const std::size_t place = free.places()[i];
    t.parameter = fitted.names()[place];
    t.unit = fitted.at(place).unit;
    std::vector<double> one, number, value, error;
    for (std::size_t g = 0; g < groups.size(); ++g) {
      const Parameter& p = fits[g].model.at(place);
      if (!p.std_error || !(*p.std_error > 0)) continue;
      t.points.push_back({names[g], p.value, *p.std_error});
      one.push_back(1);
      number.push_back(static_cast<double>(g));
      value.push_back(p.value);
      error.push_back(*p.std_error);
    }
    if (value.size() < 3) continue;
    const std::vector<std::vector<double>> columns{one, number};
    const Regression line = regress(columns, value, error);
    t.slope = line.value[1];
    t.slope_error = line.std_error[1];
    const double whole = t.slope * (number.back() - number.front());
    t.clear = std::abs(t.slope) > errors * t.slope_error && std::abs(whole) > least * std::abs(line.value[0]);
  }
  return all;
}

}  // namespace emtb
