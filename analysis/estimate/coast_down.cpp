#include "analysis/estimate/coast_down.h"

#include <cmath>

namespace emtb {
namespace {

// By hand, both held by StaticEstimates.ErrorsOfFrictionAndCoastDownCover and by docs/paper.md.
constexpr double cell = 0.2;       // [s] of a line whose slope is one point: short against J/B
constexpr std::size_t fewest = 4;  // readings of such a line: twice what it fits

/// The deceleration over the speed, cell by cell, until the shaft hardly turns.
void add_points(const Series& omega, const Stretch& open, std::vector<LinePoint>& points) {
  const double slowest = turning * largest_size(omega);
  for (double t = open.from; t + cell <= open.to + time_rounding; t += cell) {
    const LocalLine line = local_line(omega, t, t + cell);
    if (line.readings < fewest || std::abs(local_line(omega, t + cell / 2, t + cell).value) <= slowest) continue;
    const double sign = line.value > 0 ? 1 : -1;
    points.push_back({std::abs(line.value), -sign * line.slope, line.value_error, line.slope_error, 0});
  }
}

/// Does the gauge read a load?
bool is_braked(const Run& run, const Stretch& open) {
  if (!run.has(Signal::torque)) return false;
  const Mean torque = mean_over(run.at(Signal::torque), open.from, open.to);
  return std::abs(torque.value) > clear_of_zero * torque.std_error;
}

}  // namespace

StaticEstimate estimate_coast_down(std::span<const Run> runs, const KnownParameters& known) {
  StaticEstimate result{.method = StaticMethod::coast_down,
                        .title = "-dω/dt = T_c/J + (B/J) ω with open armature",
                        .x_label = "ω",
                        .x_unit = "rad/s",
                        .y_label = "-dω/dt",
                        .y_unit = "rad/s²"};
  std::vector<LinePoint> points;
  bool braked = false;
  for (const Run& run : runs) {
    const std::vector<Stretch> stretches = open_armature(run);
    if (stretches.empty() || !run.has(Signal::omega) || is_sparse(run, Signal::omega)) {
      result.left_out.push_back({{run.name, 0, run.duration()},
                                 stretches.empty() ? "the armature is never open" : "omega is missing or too slow"});
      continue;
    }
    for (const Stretch& open : stretches) {
      result.used.push_back(open);
      add_points(run.at(Signal::omega), open, points);
      braked = braked || is_braked(run, open);
    }
  }
  EstimateSeries shown{.name = "open armature"};
  for (const LinePoint& p : points) shown.add(p);
  result.series.push_back(std::move(shown));
  result.points = points.size();
  if (points.size() < 3) {
    result.lacking =
        "needs a coast-down: open the armature circuit at full speed (column armature_open) and record omega until it "
        "stands";
    return result;
  }
  result.line = fit_line(points);
  result.r_squared = result.line->r_squared;
  const double ratio = result.line->intercept, error = result.line->intercept_error;
  result.quantities = {{"T_c/J", ratio, error, "rad/s2"}, {"B/J", result.line->slope, result.line->slope_error, "1/s"}};
  if (known.T_c && ratio > 0) {
    const double J = known.T_c->value / ratio;
    result.quantities.push_back(
        {"J", J, quotient_error(J, known.T_c->std_error / known.T_c->value, error / ratio), "kg m2"});
    result.remarks.push_back("T_c = " + known.T_c_from);
  } else {
    result.remarks.emplace_back("without T_c from elsewhere (friction, or --model) a coast-down gives ratios only");
  }
  if (braked) result.remarks.emplace_back("the gauge reads a load: the brake counts as friction here");
  return result;
}

}  // namespace emtb
