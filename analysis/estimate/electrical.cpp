#include "analysis/estimate/electrical.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "analysis/numerics/regression.h"
#include "session/text.h"

namespace emtb {
namespace {

// By hand, each held by the tests of static_experiments and by figure 4 and the generator test of docs/paper.md.
constexpr double follows = 0.95;          // R2 of e_a against omega, below which e_a is not the armature's
constexpr double generator_cell = 0.1;    // [s] of a coasting machine: short against its time constant
constexpr double least_spread = 0.05;     // of the largest x: less is one point measured several times
constexpr double unknown_R_a = 0.5;       // relative standard error of R_a: more is no result
constexpr double in_proportion = 0.9999;  // squared cosine between i_a and omega: two columns that are one
constexpr std::size_t fewest = 3;         // points: one more than are fitted

constexpr std::array armature{Signal::e_a, Signal::i_a, Signal::omega};

double relative(double error, double value) { return error / std::abs(value); }

bool without_current(const SettledPoint& p) {
  return std::abs(p.at(Signal::i_a)) <= clear_of_zero * p.error(Signal::i_a);
}

std::string rounded(double value) { return shortest(std::round(10 * value) / 10); }

/// e_a/i_a over ω/i_a: the error of i_a moves both.
LinePoint point_of_equation_6(const SettledPoint& p) {
  const double i = p.at(Signal::i_a);
  LinePoint point{.x = p.at(Signal::omega) / i, .y = p.at(Signal::e_a) / i};
  const double by_i = relative(p.error(Signal::i_a), i);
  point.sigma_x = std::hypot(p.error(Signal::omega) / i, point.x * by_i);
  point.sigma_y = std::hypot(p.error(Signal::e_a) / i, point.y * by_i);
  if (point.sigma_x > 0 && point.sigma_y > 0) {
    point.correlation = point.x * point.y * by_i * by_i / (point.sigma_x * point.sigma_y);
  }
  return point;
}

/// i_a in proportion to omega: two columns that are one.
bool proportional(const std::vector<double>& i, const std::vector<double>& omega) {
  double ii = 0, ww = 0, iw = 0;
  for (std::size_t k = 0; k < i.size(); ++k) ii += i[k] * i[k], ww += omega[k] * omega[k], iw += i[k] * omega[k];
  return !(ii > 0 && ww > 0) || iw * iw > in_proportion * ii * ww;
}

/// e_a = R_a i_a + K_b ω through these points, weighed by the errors of all three in the equation.
Regression fit_armature(std::span<const SettledPoint* const> points, const std::array<std::vector<double>, 2>& columns,
                        const std::vector<double>& e) {
  constexpr int rounds = 3;  // the errors need R_a and K_b, which hardly change by them
  Regression fit = regress(columns, e);
  for (int n = 0; n < rounds; ++n) {
    std::vector<double> sigma;
    for (const SettledPoint* p : points) {
      sigma.push_back(std::hypot(p->error(Signal::e_a), fit.value[0] * p->error(Signal::i_a),
                                 fit.value[1] * p->error(Signal::omega)));
    }
    if (std::ranges::any_of(sigma, [](double s) { return !(s > 0); })) break;
    fit = regress(columns, e, sigma);
  }
  return fit;
}

/// What is drawn: the drop over R_a, e_a - K_b ω, over i_a, and the line R_a i_a through it.
void draw_drop(StaticEstimate& result, const Regression& fit, const std::vector<double>& e,
               const std::vector<double>& i, const std::vector<double>& omega) {
  std::vector<double>& drop = result.series[0].y;
  double left = 0, mean = 0, spread = 0;
  for (std::size_t k = 0; k < e.size(); ++k) {
    drop[k] = e[k] - fit.value[1] * omega[k];
    left += (drop[k] - fit.value[0] * i[k]) * (drop[k] - fit.value[0] * i[k]);
    mean += drop[k] / static_cast<double>(e.size());
  }
  for (const double y : drop) spread += (y - mean) * (y - mean);
  result.r_squared = 1 - left / spread;  // of what is drawn
  result.line = LineFit{.slope = fit.value[0],
                        .slope_error = fit.std_error[0],
                        .r_squared = result.r_squared,
                        .scatter = fit.scatter,
                        .points = fit.rows};
}

/// Voltage over speed while a machine turns with its armature open. Of a cell through which both fall, the scatter is
/// the fall; the falls cancel in the ratio, so that the points carry no errors.
void add_open_points(const Run& run, StaticEstimate& result, std::vector<LinePoint>& points) {
  if (!run.has(Signal::e_a) || !run.has(Signal::omega)) return;
  for (const Stretch& open : open_armature(run)) {
    result.used.push_back(open);
    for (double t = open.from; t + generator_cell <= open.to + time_rounding; t += generator_cell) {
      const Mean omega = mean_over(run.at(Signal::omega), t, t + generator_cell);
      const Mean e = mean_over(run.at(Signal::e_a), t, t + generator_cell);
      if (omega.readings > 0 && e.readings > 0) points.push_back({.x = omega.value, .y = e.value});
    }
  }
}

/// The same of settled points in which no current flows.
void add_settled_points(const Settled& settled, StaticEstimate& result, std::vector<LinePoint>& points) {
  const auto candidates = points_with(settled, armature, result.left_out);
  double fastest = 0;
  for (const SettledPoint* p : candidates) fastest = std::max(fastest, std::abs(p->at(Signal::omega)));
  for (const SettledPoint* p : candidates) {
    if (without_current(*p) && std::abs(p->at(Signal::omega)) > turning * fastest) {
      points.push_back({.x = p->at(Signal::omega),
                        .y = p->at(Signal::e_a),
                        .sigma_x = p->error(Signal::omega),
                        .sigma_y = p->error(Signal::e_a)});
      result.used.push_back(p->where);
    } else {
      result.left_out.push_back({p->where, "current flows, or nothing turns"});
    }
  }
}

}  // namespace

StaticEstimate estimate_equation_6(const Settled& settled) {
  StaticEstimate result{.method = StaticMethod::equation_6,
                        .title = "e_a/i_a = K_b ω/i_a + R_a, equation (6)",
                        .x_label = "ω / i_{a}",
                        .x_unit = "rad/(A s)",
                        .y_label = "e_{a} / i_{a}",
                        .y_unit = "V/A"};
  std::vector<LinePoint> points;
  EstimateSeries shown{.name = "settled points"};
  double smallest = 0, largest = 0;
  for (const SettledPoint* p : points_with(settled, armature, result.left_out)) {
    if (without_current(*p)) {
      result.left_out.push_back({p->where, "i_a is lost in its own error: e_a/i_a would be noise"});
      continue;
    }
    const LinePoint point = point_of_equation_6(*p);
    points.push_back(point);
    shown.add(point);
    result.used.push_back(p->where);
    smallest = points.size() == 1 ? point.x : std::min(smallest, point.x);
    largest = std::max(largest, point.x);
  }
  result.points = points.size();
  result.series.push_back(std::move(shown));
  if (points.size() < fewest || largest - smallest < least_spread * largest) {
    result.lacking = "needs three or more settled points with e_a, i_a and omega whose ω/i_a differ, here are " +
                     std::to_string(points.size()) + (points.size() < fewest ? "" : " with the same") +
                     ". Raise the voltage from 0 in steps of some seconds each (a staircase), or vary the load";
    return result;
  }
  result.line = fit_line(points);
  if (const LineFit& line = *result.line; line.intercept_error > unknown_R_a * std::abs(line.intercept)) {
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
  StaticEstimate result{.method = StaticMethod::armature,
                        .title = "e_a = R_a i_a + K_b ω, without the division",
                        .x_label = "i_{a}",
                        .x_unit = "A",
                        .y_label = "e_{a} - K_{b} ω",
                        .y_unit = "V"};
  std::vector<double> e;
  std::array<std::vector<double>, 2> columns;
  auto& [i, omega] = columns;
  std::vector<const SettledPoint*> points;
  for (const SettledPoint* p : points_with(settled, armature, result.left_out)) {
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
  if (points.size() < fewest || proportional(i, omega)) {
    result.lacking =
        "needs three or more settled points with e_a, i_a and omega in which i_a is not in proportion to "
        "omega, here are " +
        std::to_string(points.size()) + ". Vary the voltage and the load (brake), a few seconds each";
    return result;
  }
  const Regression fit = fit_armature(points, columns, e);
  result.quantities = {{"R_a", fit.value[0], fit.std_error[0], "ohm"},
                       {"K_b", fit.value[1], fit.std_error[1], "V s/rad"}};
  draw_drop(result, fit, e, i, omega);
  return result;
}

StaticEstimate estimate_generator(std::span<const Run> runs, const Settled& settled) {
  StaticEstimate result{.method = StaticMethod::generator,
                        .title = "e_a = K_b ω while no current flows",
                        .x_label = "ω",
                        .x_unit = "rad/s",
                        .y_label = "e_{a}",
                        .y_unit = "V"};
  std::vector<LinePoint> points;
  for (const Run& run : runs) add_open_points(run, result, points);
  if (result.used.empty()) add_settled_points(settled, result, points);
  result.points = points.size();
  EstimateSeries shown{.name = "open armature"};
  for (const LinePoint& p : points) shown.x.push_back(p.x), shown.y.push_back(p.y);
  result.series.push_back(std::move(shown));
  const auto [low, high] = std::ranges::minmax(result.series[0].x.empty() ? std::vector{0.0} : result.series[0].x);
  if (points.size() < fewest || !(high - low > least_spread * std::max(std::abs(high), std::abs(low)))) {
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
