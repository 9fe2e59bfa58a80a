#include "analysis/estimate/acceleration.h"

#include <algorithm>
#include <array>

#include "analysis/numerics/regression.h"

namespace emtb {
namespace {

// By hand, each held by Acceleration.FindsTheInertiaFromAFastAndFromAnAveragingMeter and by the table of J in
// docs/paper.md.
constexpr double fast_window = 0.1;  // [s] over which a fast current is averaged: short against a shaft's time constant
constexpr double edge = 5;           // readings to each side of an instant, whose speed is a line's through them
constexpr std::size_t fewest = 6;    // windows: twice what is fitted
constexpr double least_change = 1;   // [rad/s2] between accelerations: less is a machine that keeps its speed
constexpr double collinear = 0.98;   // share of the acceleration that the speed explains

/// Means over windows in which the shaft turns forwards, one an equation.
struct Windows {
  std::vector<double> acceleration;  ///< [rad/s2]
  std::vector<double> speed;         ///< [rad/s]
  std::vector<double> one;
  std::vector<double> torque;  ///< [N m]; [A] where K_m is not known
};

/// Adds the windows of one run.
class Balance {
 public:
  Balance(const Run& run, const KnownParameters& known, Windows& windows)
      : run_(run),
        omega_(run.at(Signal::omega)),
        K_m_(known.K_m ? known.K_m->value : 1),
        slowest_(turning * largest_size(omega_)),
        open_(open_armature(run)),
        interval_(run.duration() / static_cast<double>(omega_.t.size())),
        windows_(windows) {}

  void add_all() {
    const Series& current = run_.at(Signal::i_a);
    const bool slow = current.window > 0 || is_sparse(run_, Signal::i_a);
    if (slow) {
      for (std::size_t k = 1; k < current.t.size(); ++k) add(window_start(current, k), current.t[k], current.value[k]);
      return;
    }
    for (double t = 0; t + fast_window <= run_.duration(); t += fast_window) {
      const Mean i = mean_over(current, t, t + fast_window);
      if (i.readings > 0) add(t, t + fast_window, i.value);
    }
  }

 private:
  /// @param i [A] mean over the window
  void add(double from, double to, double i) {
    const double half = std::min(edge * interval_, (to - from) / 4);
    if (from < half || to > run_.duration() - half || !(to > from)) return;
    for (const Stretch& s : open_) {
      if (from < s.to && to > s.from) return;
    }
    if (mean_over(omega_, from - half, from).value <= slowest_) return;  // dry friction is not T_c at rest
    const LocalLine first = local_line(omega_, from - half, from + half),
                    last = local_line(omega_, to - half, to + half);
    const double mean = mean_over(omega_, from, to).value;
    if (std::min({first.value, last.value, mean}) <= slowest_) return;
    windows_.acceleration.push_back((last.value - first.value) / (to - from));
    windows_.speed.push_back(mean);
    windows_.one.push_back(1);
    windows_.torque.push_back(K_m_ * i);
    if (run_.has(Signal::torque)) windows_.torque.back() -= mean_over(run_.at(Signal::torque), from, to).value;
  }

  const Run& run_;
  const Series& omega_;
  double K_m_;      ///< [N m/A]; 1 where it is not known
  double slowest_;  ///< [rad/s]
  std::vector<Stretch> open_;
  double interval_;  ///< [s] between readings of the speed
  Windows& windows_;
};

Windows windows_of(std::span<const Run> runs, const KnownParameters& known, StaticEstimate& result) {
  Windows windows;
  for (const Run& run : runs) {
    if (!run.has(Signal::i_a) || !run.has(Signal::omega) || is_sparse(run, Signal::omega)) {
      result.left_out.push_back({{run.name, 0, run.duration()}, "needs i_a and a fast omega"});
      continue;
    }
    const std::size_t before = windows.torque.size();
    Balance(run, known, windows).add_all();
    if (windows.torque.size() > before) {
      result.used.push_back({run.name, 0, run.duration()});
    } else {
      result.left_out.push_back({{run.name, 0, run.duration()}, "nothing turns forwards"});
    }
  }
  return windows;
}

/// J, B and T_c of the windows, or J alone where friction is known from elsewhere. Takes the friction out of their
/// torque, so that what is left is to be drawn over the acceleration.
Regression fit_inertia(Windows& windows, const KnownParameters& known, bool inertia_alone) {
  std::vector<double>& torque = windows.torque;
  const std::vector<double>& speed = windows.speed;
  if (inertia_alone) {
    const bool friction = known.T_c && known.B;
    for (std::size_t k = 0; k < torque.size(); ++k) {
      torque[k] -= friction ? known.T_c->value + known.B->value * speed[k] : 0;
    }
    return regress(std::array{windows.acceleration}, torque);
  }
  Regression fit = regress(std::array{windows.acceleration, speed, windows.one}, torque);
  for (std::size_t k = 0; k < torque.size(); ++k) torque[k] -= fit.value[1] * speed[k] + fit.value[2];
  return fit;
}

}  // namespace

StaticEstimate estimate_acceleration(std::span<const Run> runs, const KnownParameters& known) {
  StaticEstimate result{.method = StaticMethod::acceleration,
                        .title = "K_m i_a - torque - B ω - T_c = J dω/dt, as means over windows",
                        .x_label = "Δω / Δt",
                        .x_unit = "rad/s²",
                        .y_label = "K_{m} i_{a} - torque - B ω - T_{c}",
                        .y_unit = "N m"};
  Windows windows = windows_of(runs, known, result);
  const std::vector<double>& acceleration = windows.acceleration;
  result.points = acceleration.size();
  const auto draw = [&] { result.series.push_back({.name = "windows", .x = acceleration, .y = windows.torque}); };
  const auto [slowest, fastest] = std::ranges::minmax(acceleration.empty() ? std::vector{0.0} : acceleration);
  if (acceleration.size() < fewest || !(fastest - slowest > least_change)) {
    draw();
    result.lacking = "needs six or more readings of i_a in motion, some of them while the speed changes, here are " +
                     std::to_string(acceleration.size()) + ". Run up and down: steps of 0.5 s or more";
    return result;
  }
  // One rise to one speed: the acceleration follows from the speed, and three parameters from two numbers do not.
  const bool alike = regress(std::array{windows.speed, windows.one}, acceleration).r_squared > collinear;
  const Regression fit = fit_inertia(windows, known, alike);
  draw();
  if (!known.K_m) {
    result.lacking = needs_K_m;
    return result;
  }
  if (alike && !(known.T_c && known.B)) {
    result.lacking =
        "the acceleration follows from the speed (one rise to one speed), so J, B and T_c cannot be told "
        "apart. Run up and down to several speeds, or give T_c and B: --model FILE with dry friction";
    return result;
  }
  result.r_squared = fit.r_squared;
  result.quantities = {{"J", fit.value[0], fit.std_error[0], "kg m2"}};
  if (alike) {
    result.remarks.push_back("T_c and B = " + known.T_c_from);
  } else {
    result.quantities.push_back({"B", fit.value[1], fit.std_error[1], "N m s/rad"});
    result.quantities.push_back({"T_c", fit.value[2], fit.std_error[2], "N m"});
  }
  result.line = LineFit{.slope = fit.value[0],
                        .slope_error = fit.std_error[0],
                        .r_squared = fit.r_squared,
                        .scatter = fit.scatter,
                        .points = fit.rows};
  result.remarks.push_back("K_m = " + known.K_m_from);
  return result;
}

}  // namespace emtb
