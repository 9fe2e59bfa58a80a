#include "analysis/estimate/electrical.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "analysis/estimate/stretches.h"
#include "analysis/numerics/regression.h"
#include "hal/error.h"
#include "session/text.h"

namespace emtb {
namespace {

constexpr double follows = 0.95;        // R2 of e_a against omega
constexpr double generator_cell = 0.1;  // [s]

const std::vector<Signal> armature{Signal::e_a, Signal::i_a, Signal::omega};

double relative(double error, double value) { return error / std::abs(value); }

bool without_current(const SettledPoint& p) {
  return std::abs(p.at(Signal::i_a)) <= clear_of_zero * p.error(Signal::i_a);
}

std::string rounded(double value) { return shortest(std::round(10 * value) / 10); }

StaticEstimate start(const char* method, const char* title) {
  StaticEstimate result{.what = "resistance", .method = method, .title = title};
  return result;
}

}  // namespace

StaticEstimate estimate_equation_6(const Settled& settled) {
  StaticEstimate result = start("equation_6", "e_a/i_a = K_b ω/i_a + R_a, equation (6)");
  result.x_label = "ω / i_{a}";
  result.x_unit = "rad/(A s)";
  result.y_label = "e_{a} / i_{a}";
  result.y_unit = "V/A";
  std::vector<LinePoint> points;
  EstimateSeries shown{.name = "settled points"};
  double smallest = 0, largest = 0;
  for (const SettledPoint* p : points_with(settled, armature, result)) {
    const double e = p->at(Signal::e_a), i = p->at(Signal::i_a), omega = p->at(Signal::omega);
    if (without_current(*p)) {
      result.left_out.push_back({p->where, "i_a is lost in its own error: e_a/i_a would be noise"});
      continue;
    }
    LinePoint point{.x = omega / i, .y = e / i};
    const double by_i = relative(p->error(Signal::i_a), i);
    point.sigma_x = std::hypot(p->error(Signal::omega) / i, point.x * by_i);
    point.sigma_y = std::hypot(p->error(Signal::e_a) / i, point.y * by_i);
    if (point.sigma_x > 0 && point.sigma_y > 0) {
      point.correlation = point.x * point.y * by_i * by_i / (point.sigma_x * point.sigma_y);
    }
    points.push_back(point);
    shown.x.push_back(point.x);
    shown.y.push_back(point.y);
    shown.y_error.push_back(point.sigma_y);
    result.used.push_back(p->where);
    smallest = points.size() == 1 ? point.x : std::min(smallest, point.x);
    largest = std::max(largest, point.x);
  }
  result.points = points.size();
  result.series.push_back(std::move(shown));
  if (points.size() < 3 || largest - smallest < 0.05 * largest) {
    result.lacking = "needs three or more settled points with e_a, i_a and omega whose ω/i_a differ, here are " +
                     std::to_string(points.size()) + (points.size() < 3 ? "" : " with the same") +
                     ". Raise the voltage from 0 in steps of some seconds each (a staircase), or vary the load";
    return result;
  }
  result.line = fit_line(points);
  if (const LineFit& line = *result.line; line.intercept_error > 0.5 * std::abs(line.intercept)) {
    result.lacking = "needs points that fix R_a; these leave it at " + rounded(line.intercept) + " +- " +
                     rounded(line.intercept_error) + " ohm. Load the motor (a brake), so that more current flows";
    result.line.reset();
    return result;
  }
  result.r_squared = result.line->r_squared;
  result.quantities = {{"R_a", result.line->intercept, result.line->intercept_error, "ohm"},
                       {"K_b", result.line->slope, result.line->slope_error, "V s/rad"}};
  return result;
}

StaticEstimate estimate_armature(const Settled& settled) {
  StaticEstimate result = start("armature", "e_a = R_a i_a + K_b ω, without the division");
  result.x_label = "i_{a}";
  result.x_unit = "A";
  result.y_label = "e_{a} - K_{b} ω";
  result.y_unit = "V";
  std::vector<double> e, i, omega;
  std::vector<const SettledPoint*> points;
  for (const SettledPoint* p : points_with(settled, armature, result)) {
    if (p->at(Signal::i_a) == 0 && p->at(Signal::omega) == 0) {
      result.left_out.push_back({p->where, "at rest without current"});
      continue;
    }
    points.push_back(p);
    e.push_back(p->at(Signal::e_a));
    i.push_back(p->at(Signal::i_a));
    omega.push_back(p->at(Signal::omega));
    result.used.push_back(p->where);
  }
  result.points = points.size();
  result.series.push_back({.name = "settled points", .x = i, .y = e});
  const auto alike = [&] {  // i_a in proportion to omega: two columns that are one
    double ii = 0, ww = 0, iw = 0;
    for (std::size_t k = 0; k < i.size(); ++k) ii += i[k] * i[k], ww += omega[k] * omega[k], iw += i[k] * omega[k];
    return !(ii > 0 && ww > 0) || iw * iw > 0.9999 * ii * ww;
  };
  if (points.size() < 3 || alike()) {
    result.lacking =
        "needs three or more settled points with e_a, i_a and omega in which i_a is not in proportion to "
        "omega, here are " +
        std::to_string(points.size()) + ". Vary the voltage and the load (brake), a few seconds each";
    return result;
  }
  const std::array columns{i, omega};
  Regression fit = regress(columns, e);
  // The errors of all three in the equation; they need R_a and K_b, which hardly change by them.
  for (int n = 0; n < 3; ++n) {
    std::vector<double> sigma;
    for (const SettledPoint* p : points) {
      sigma.push_back(std::hypot(p->error(Signal::e_a), fit.value[0] * p->error(Signal::i_a),
                                 fit.value[1] * p->error(Signal::omega)));
    }
    if (std::ranges::any_of(sigma, [](double s) { return !(s > 0); })) break;
    fit = regress(columns, e, sigma);
  }
  result.quantities = {{"R_a", fit.value[0], fit.std_error[0], "ohm"},
                       {"K_b", fit.value[1], fit.std_error[1], "V s/rad"}};
  double left = 0, mean = 0, spread = 0;
  std::vector<double>& drop = result.series[0].y;
  for (std::size_t k = 0; k < e.size(); ++k) {
    drop[k] = e[k] - fit.value[1] * omega[k];
    left += (drop[k] - fit.value[0] * i[k]) * (drop[k] - fit.value[0] * i[k]);
    mean += drop[k] / static_cast<double>(e.size());
  }
  for (const double y : drop) spread += (y - mean) * (y - mean);
  result.r_squared = 1 - left / spread;  // of what is drawn: the drop over R_a
  result.line = LineFit{.slope = fit.value[0],
                        .slope_error = fit.std_error[0],
                        .r_squared = result.r_squared,
                        .scatter = fit.scatter,
                        .points = fit.rows};
  return result;
}

StaticEstimate estimate_generator(std::span<const Run> runs, const Settled& settled) {
  StaticEstimate result{.what = "generator", .method = "generator", .title = "e_a = K_b ω while no current flows"};
  result.x_label = "ω";
  result.x_unit = "rad/s";
  result.y_label = "e_{a}";
  result.y_unit = "V";
  std::vector<LinePoint> points;
  const auto add = [&](const Mean& omega, const Mean& e) {
    points.push_back({.x = omega.value, .y = e.value, .sigma_x = omega.std_error, .sigma_y = e.std_error});
  };
  for (const Run& run : runs) {
    if (!run.has(Signal::e_a) || !run.has(Signal::omega)) continue;
    for (const Stretch& open : open_armature(run)) {
      result.used.push_back(open);
      for (double t = open.from; t + generator_cell <= open.to + 1e-9; t += generator_cell) {
        const Mean omega = mean_over(run.at(Signal::omega), t, t + generator_cell);
        const Mean e = mean_over(run.at(Signal::e_a), t, t + generator_cell);
        // Of a cell through which both fall, the scatter is the fall; the falls cancel in the ratio.
        if (omega.readings > 0 && e.readings > 0) add({.value = omega.value}, {.value = e.value});
      }
    }
  }
  if (result.used.empty()) {
    const auto candidates = points_with(settled, armature, result);
    double fastest = 0;
    for (const SettledPoint* p : candidates) fastest = std::max(fastest, std::abs(p->at(Signal::omega)));
    for (const SettledPoint* p : candidates) {
      if (without_current(*p) && std::abs(p->at(Signal::omega)) > turning * fastest) {
        add(p->mean.at(Signal::omega), p->mean.at(Signal::e_a));
        result.used.push_back(p->where);
      } else {
        result.left_out.push_back({p->where, "current flows, or nothing turns"});
      }
    }
  }
  result.points = points.size();
  EstimateSeries shown{.name = "open armature"};
  for (const LinePoint& p : points) shown.x.push_back(p.x), shown.y.push_back(p.y);
  result.series.push_back(std::move(shown));
  const auto [low, high] = std::ranges::minmax(result.series[0].x.empty() ? std::vector{0.0} : result.series[0].x);
  if (points.size() < 3 || !(high - low > 0.05 * std::max(std::abs(high), std::abs(low)))) {
    result.lacking = "needs e_a and omega at several speeds while no current flows, here are " +
                     std::to_string(points.size()) +
                     " points. Open the armature circuit at speed (column armature_open) and record while it coasts";
    return result;
  }
  result.line = fit_line(points);
  result.r_squared = result.line->r_squared;
  if (result.r_squared < follows) {
    result.lacking = "needs e_a that follows omega (R2 is " + shortest(std::round(100 * result.r_squared) / 100) +
                     "): measure it at the armature's terminals, behind the contactor";
    return result;
  }
  result.quantities = {{"K_b", result.line->slope, result.line->slope_error, "V s/rad"},
                       {"offset", result.line->intercept, result.line->intercept_error, "V"}};
  return result;
}

}  // namespace emtb
