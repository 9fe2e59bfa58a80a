#include "analysis/estimate/torque.h"

#include <algorithm>
#include <array>
#include <cmath>
namespace emtb {
namespace {

// By hand, held by the printed lines of figures 5 and 6 in the tests, and by docs/paper.md.
constexpr double one_voltage = 0.02;  // of the largest: what an unregulated supply sags
constexpr double load_spread = 0.05;  // of the largest speed, of a brake's line: it sags little at one voltage
constexpr double least_spread = 0.1;  // of the largest x otherwise: less is one point measured several times
constexpr std::size_t fewest = 3;     // points: one more than are fitted

double largest(const std::vector<const SettledPoint*>& points, Signal signal) {
  double most = 0;
  for (const SettledPoint* p : points) most = std::max(most, std::abs(p->at(signal)));
  return most;
}

struct Line {
  std::vector<LinePoint> points;
  EstimateSeries shown{.name = "settled points"};

  void add(StaticEstimate& result, const Stretch& where, const LinePoint& p) {
    points.push_back(p);
    shown.add(p);
    result.used.push_back(where);
  }

  /// @return whether there is a line to be had; the points are drawn in any case
  bool fit(StaticEstimate& result, double spread) {
    result.points = points.size();
    double low = 0, high = 0;
    if (!shown.x.empty()) {
      const auto [least, most] = std::ranges::minmax(shown.x);
      low = least;
      high = most;
    }
    result.series.push_back(shown);
    if (points.size() < fewest || !(high - low >= spread * std::max(std::abs(low), std::abs(high)))) return false;
    result.line = fit_line(points);
    result.r_squared = result.line->r_squared;
    return true;
  }
};

}  // namespace

StaticEstimate estimate_load_line(const Settled& settled) {
  StaticEstimate result{.method = StaticMethod::load_line,
                        .title = "torque = slope ω + intercept, as section 3.2",
                        .x_label = "ω",
                        .x_unit = "rad/s",
                        .y_label = "torque",
                        .y_unit = "N m"};
  static constexpr std::array needed{Signal::torque, Signal::omega};
  const auto points = points_with(settled, needed, result.left_out);
  const double fastest = largest(points, Signal::omega);
  Line line;
  double lowest = 0, highest = 0;
  for (const SettledPoint* p : points) {
    if (std::abs(p->at(Signal::omega)) <= turning * fastest) {
      result.left_out.push_back({p->where, "at rest"});
    } else if (std::abs(p->at(Signal::torque)) <= clear_of_zero * p->error(Signal::torque)) {
      result.left_out.push_back({p->where, "no load"});
    } else {
      line.add(result, p->where,
               {p->at(Signal::omega), p->at(Signal::torque), p->error(Signal::omega), p->error(Signal::torque), 0});
      if (p->has(Signal::e_a)) {
        lowest = lowest == 0 ? p->at(Signal::e_a) : std::min(lowest, p->at(Signal::e_a));
        highest = std::max(highest, p->at(Signal::e_a));
      }
    }
  }
  if (!line.fit(result, load_spread)) {
    result.lacking =
        "needs three or more settled points under load at different speeds, with torque and omega, here are " +
        std::to_string(line.points.size()) + ". Set the brake, then lower the voltage in steps of some seconds each";
    return result;
  }
  result.quantities = {{"slope", result.line->slope, result.line->slope_error, "N m s/rad"},
                       {"intercept", result.line->intercept, result.line->intercept_error, "N m"}};
  if (highest - lowest <= one_voltage * highest) {
    result.remarks.emplace_back("one voltage throughout: the slope is the machine's own, -(K_m K_b/R_a + B), not B");
  } else {
    result.remarks.emplace_back(
        "the gauge sees the load alone: slope and intercept are the brake's, not the motor's friction");
  }
  return result;
}

StaticEstimate estimate_friction(const Settled& settled, const KnownParameters& known) {
  StaticEstimate result{.method = StaticMethod::friction,
                        .title = "K_m i_a - torque = B ω + T_c",
                        .x_label = "ω",
                        .x_unit = "rad/s",
                        .y_label = "K_{m} i_{a} - torque",
                        .y_unit = "N m"};
  static constexpr std::array needed{Signal::i_a, Signal::omega};
  const auto points = points_with(settled, needed, result.left_out);
  const double fastest = largest(points, Signal::omega);
  const double K_m = known.K_m ? known.K_m->value : 1;
  bool gauge = false;
  Line line;
  for (const SettledPoint* p : points) {
    const double omega = p->at(Signal::omega);
    if (std::abs(omega) <= turning * fastest) {
      result.left_out.push_back({p->where, "at rest, where friction takes whatever torque there is"});
      continue;
    }
    const double forward = omega > 0 ? 1 : -1;  // friction opposes: both directions lie on one line
    LinePoint point{std::abs(omega), forward * K_m * p->at(Signal::i_a), p->error(Signal::omega),
                    K_m * p->error(Signal::i_a), 0};
    if (p->has(Signal::torque)) {
      gauge = true;
      point.y -= forward * p->at(Signal::torque);
      point.sigma_y = std::hypot(point.sigma_y, p->error(Signal::torque));
    }
    line.add(result, p->where, point);
  }
  if (!known.K_m) {
    result.y_label = "i_{a}";
    result.y_unit = "A";
  }
  const bool enough = line.fit(result, least_spread);
  if (!known.K_m) {
    result.line.reset();
    result.lacking =
        "needs K_m to turn i_a into torque. Give --model FILE, or record e_a too: K_b of the armature is K_m";
    return result;
  }
  if (!enough) {
    result.lacking = "needs three or more settled speeds with i_a and omega, here are " +
                     std::to_string(line.points.size()) + ". Run without load at several voltages (a staircase)";
    return result;
  }
  result.quantities = {{"T_c", result.line->intercept, result.line->intercept_error, "N m"},
                       {"B", result.line->slope, result.line->slope_error, "N m s/rad"}};
  result.remarks.push_back("K_m = " + known.K_m_from);
  if (!gauge)
    result.remarks.emplace_back("no torque was measured: the shaft is taken as free, a brake would count as friction");
  return result;
}

StaticEstimate estimate_torque_constant(const Settled& settled) {
  StaticEstimate result{.method = StaticMethod::torque_constant,
                        .title = "torque = K_m i_a - T_0, as section 3.3",
                        .x_label = "i_{a}",
                        .x_unit = "A",
                        .y_label = "torque",
                        .y_unit = "N m"};
  static constexpr std::array needed{Signal::i_a, Signal::torque, Signal::omega};
  const auto points = points_with(settled, needed, result.left_out);
  const double fastest = largest(points, Signal::omega);
  Line line;
  for (const SettledPoint* p : points) {
    if (std::abs(p->at(Signal::omega)) <= turning * fastest) {
      result.left_out.push_back({p->where, "at rest, where friction takes whatever torque there is"});
      continue;
    }
    line.add(result, p->where,
             {p->at(Signal::i_a), p->at(Signal::torque), p->error(Signal::i_a), p->error(Signal::torque), 0});
  }
  const bool loaded =
      std::ranges::any_of(line.points, [](const LinePoint& p) { return std::abs(p.y) > clear_of_zero * p.sigma_y; });
  if (!line.fit(result, least_spread) || !loaded) {
    result.line.reset();
    result.lacking = "needs three or more settled points with i_a, torque and omega under different loads, here are " +
                     std::to_string(line.points.size()) + (loaded || line.points.empty() ? "" : " without load") +
                     ". At full voltage turn the brake up in steps of some seconds each";
    return result;
  }
  result.quantities = {{"K_m", result.line->slope, result.line->slope_error, "N m/A"},
                       {"T_0", -result.line->intercept, result.line->intercept_error, "N m"}};
  result.remarks.emplace_back(
      "T_0 is the whole no-load loss; K_m carries the gauge's gain and whatever the meter makes of the current");
  return result;
}

}  // namespace emtb
