#include "analysis/estimate/inverse_dynamics.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "analysis/estimate/static_estimate.h"
#include "analysis/numerics/even_series.h"
#include "analysis/numerics/regression.h"
#include "hal/error.h"

namespace emtb {
namespace {

// By hand, held by the tests of inverse dynamics and by docs/data/emps.md.
constexpr double half_width = 0.02;  ///< [s] short against any shaft here, long against the steps of an encoder
constexpr std::size_t fewest = 20;   ///< rows: five for each unknown
constexpr std::size_t kernels = 4;   ///< whole kernels in a run: less is all ends

/// Slope of the least-squares line over +-m samples; m fewer samples at both ends.
std::vector<double> slope(const std::vector<double>& x, std::size_t m, double interval) {
  std::vector<double> y;
  const double squares = static_cast<double>(m) * static_cast<double>(m + 1) * static_cast<double>(2 * m + 1) / 3;
  for (std::size_t k = m; k + m < x.size(); ++k) {
    double sum = 0;
    for (std::size_t j = 1; j <= m; ++j) sum += static_cast<double>(j) * (x[k + j] - x[k - j]);
    y.push_back(sum / squares / interval);
  }
  return y;
}

/// The mean of x under the kernel by which slope() weighs a derivative: 1 - (j/m)^2 in the limit.
std::vector<double> smooth(const std::vector<double>& x, std::size_t m) {
  std::vector<double> weights(2 * m + 1);
  double total = 0;
  for (std::size_t j = 0; j <= 2 * m; ++j) {
    const double u = (static_cast<double>(j) - static_cast<double>(m)) / (static_cast<double>(m) + 0.5);
    total += weights[j] = 1 - u * u;
  }
  std::vector<double> y;
  for (std::size_t k = m; k + m < x.size(); ++k) {
    double sum = 0;
    for (std::size_t j = 0; j <= 2 * m; ++j) sum += weights[j] * x[k - m + j];
    y.push_back(sum / total);
  }
  return y;
}

std::vector<double> trimmed(const std::vector<double>& x, std::size_t m) {
  return {x.begin() + static_cast<std::ptrdiff_t>(m), x.end() - static_cast<std::ptrdiff_t>(m)};
}

struct Rows {
  std::vector<double> torque, acceleration, speed, sign;
};

void append(const Run& run, double k_m, Rows& rows) {
  const bool from_angle = run.has(Signal::theta);
  if (!run.has(Signal::i_a))
    throw SessionError(
        run.name +
        " has no i_a_A: inverse dynamics need the current (or the torque command of a current drive, mapped to i_a)");
  if (!from_angle && !run.has(Signal::omega)) throw SessionError(run.name + " has neither theta_rad nor omega_rad_s");
  const Series& motion = run.at(from_angle ? Signal::theta : Signal::omega);
  const Series& current = run.at(Signal::i_a);
  if (current.t.size() != motion.t.size()) {
    throw SessionError(run.name +
                       ": i_a_A is not read as often as the motion. Inverse dynamics need a fast current; use emtb "
                       "calibrate, which models a slow meter");
  }
  const double interval = mean_interval(motion.t);
  const auto m = static_cast<std::size_t>(std::max(2.0, std::round(half_width / interval)));
  if (motion.t.size() < kernels * 2 * m) throw SessionError(run.name + " is too short for inverse dynamics");
  std::vector<double> i_a = current.value, omega = motion.value;
  if (from_angle) {
    omega = slope(motion.value, m, interval);
    i_a = smooth(i_a, m);
  }
  std::vector<double> sign(omega.size());
  std::ranges::transform(omega, sign.begin(), [](double w) { return w > 0 ? 1.0 : -1.0; });
  const std::vector<double> acceleration = slope(omega, m, interval), speed = smooth(omega, m), torque = smooth(i_a, m);
  const std::vector<double> smooth_sign = smooth(sign, m), raw = trimmed(omega, m);
  const double fastest = std::abs(*std::ranges::max_element(omega, {}, [](double w) { return std::abs(w); }));
  for (std::size_t k = 0; k < speed.size(); k += 2 * m) {
    if (std::abs(smooth_sign[k]) < 1 || std::abs(raw[k]) <= turning * fastest) continue;  // near standstill
    rows.torque.push_back(k_m * torque[k]);
    rows.acceleration.push_back(acceleration[k]);
    rows.speed.push_back(speed[k]);
    rows.sign.push_back(smooth_sign[k]);
  }
}

}  // namespace

InverseDynamics inverse_dynamics(std::span<const Run> runs, double k_m) {
  Rows rows;
  for (const Run& run : runs) append(run, k_m, rows);
  const std::size_t n = rows.torque.size();
  if (n < fewest) throw SessionError("too few readings in motion for inverse dynamics: " + std::to_string(n) + " rows");
  const std::vector<double> ones(rows.torque.size(), 1.0);
  const Regression fit = regress(std::array{rows.acceleration, rows.speed, rows.sign, ones}, rows.torque);
  InverseDynamics result;
  const char* const symbols[] = {"J", "B", "T_c", "T_L"};
  const char* const units[] = {"kg m2", "N m s/rad", "N m", "N m"};
  for (std::size_t i = 0; i < 4; ++i) result.values.push_back({symbols[i], units[i], fit.value[i], fit.std_error[i]});
  result.residual = fit.scatter;
  result.r_squared = fit.r_squared;
  result.rows = fit.rows;
  return result;
}

}  // namespace emtb
