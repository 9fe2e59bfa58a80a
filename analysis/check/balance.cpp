#include "analysis/check/balance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <span>

#include "analysis/numerics/regression.h"

namespace emtb {
namespace {

using Column = std::function<double(const MotionWindow&)>;

std::vector<double> column(const MotionWindows& w, const Column& c) {
  std::vector<double> x;
  for (const MotionWindow& m : w.all) x.push_back(c(m));
  return x;
}

double variation(const std::vector<double>& x) {
  double sum = 0, squares = 0;
  for (const double v : x) sum += v, squares += v * v;
  const auto n = static_cast<double>(x.size());
  return std::sqrt(std::max(0.0, squares / n - sum * sum / (n * n)));
}

/// Least squares of y on columns and a constant; a column that does not vary has no share.
std::vector<Share> shares(const MotionWindows& w, const Column& y, std::span<const Column> of) {
  std::vector<Share> result(of.size());
  std::vector<std::vector<double>> columns;
  std::vector<std::size_t> place;
  std::vector<double> scale;
  for (std::size_t k = 0; k < of.size(); ++k) {
    std::vector<double> x = column(w, of[k]);
    const double size = variation(x);
    if (!(size > 0)) continue;
    for (double& v : x) v /= size;
    columns.push_back(std::move(x));
    place.push_back(k);
    scale.push_back(size);
  }
  const std::vector<double> wanted = column(w, y);
  if (columns.empty() || w.all.size() < 20 + columns.size() || !(variation(wanted) > 0)) return result;
  columns.emplace_back(w.all.size(), 1.0);
  const Regression fit = regress(columns, wanted);
  const auto freedom = static_cast<double>(w.all.size() - columns.size());
  for (std::size_t c = 0; c < place.size(); ++c) {
    if (!std::isfinite(fit.value[c]) || !(fit.std_error[c] > 0)) continue;
    const double t = fit.value[c] / fit.std_error[c];
    result[place[c]] = {fit.value[c] / scale[c], t, t / std::sqrt(t * t + freedom)};
  }
  return result;
}

/// A torque that goes with the speed, as a generator's does, and is read a little late: what its column says, that of
/// the speed takes back.
bool is_taken_back(const MotionWindows& w, const Share& torque) {
  constexpr double most = 2;  // times as much as the current varies
  return std::abs(torque.value) * variation(column(w, &MotionWindow::torque)) >
         most * variation(column(w, &MotionWindow::current));
}

double alike(const MotionWindows& w, const Column& a, const Column& b) {
  double ab = 0, aa = 0, bb = 0;
  for (const MotionWindow& m : w.all) ab += a(m) * b(m), aa += a(m) * a(m), bb += b(m) * b(m);
  return aa > 0 && bb > 0 ? ab / std::sqrt(aa * bb) : 0;
}

}  // namespace

MotorBalance balance_of(const MotionWindows& w) {
  MotorBalance b;
  if (w.all.size() < 10) return b;
  if (w.voltage) {
    b.driven = alike(w, &MotionWindow::voltage, &MotionWindow::speed);
    b.sped_up = alike(w, &MotionWindow::voltage, &MotionWindow::acceleration);
    double eo = 0, oo = 0;
    for (const MotionWindow& m : w.all) eo += m.voltage * m.speed, oo += m.speed * m.speed;
    b.gain = oo > 0 ? eo / oo : 0;
  }
  if (!w.current) return b;
  b.back_power = alike(w, &MotionWindow::current, &MotionWindow::speed);
  b.pulled = alike(w, &MotionWindow::current, &MotionWindow::acceleration);
  if (w.voltage) {
    b.power_in = alike(w, &MotionWindow::voltage, &MotionWindow::current);
    const std::vector<Column> of{&MotionWindow::current, &MotionWindow::speed};
    const auto s = shares(w, &MotionWindow::voltage, of);
    b.resistance = s[0], b.back_emf = s[1];
  }
  const std::vector<Column> of{&MotionWindow::acceleration, &MotionWindow::speed, &MotionWindow::torque};
  const auto s = shares(w, &MotionWindow::current, of);
  b.inertia = s[0], b.viscous = s[1], b.torque = s[2];
  if (is_taken_back(w, b.torque)) b.torque.t = b.torque.partial = 0;
  return b;
}

MotorConstants constants_of(const MotionWindows& w) {
  if (!w.voltage || !w.speed) return {};
  constexpr double at_rest = 0.02;  // of the fastest
  double fastest = 0;
  for (const MotionWindow& m : w.all) fastest = std::max(fastest, std::abs(m.speed));
  const auto direction = [still = at_rest * fastest](const MotionWindow& m) {
    return std::abs(m.speed) <= still ? 0.0 : std::copysign(1.0, m.speed);
  };
  const Column beside = w.current ? &MotionWindow::current : &MotionWindow::acceleration;
  const auto s = shares(w, &MotionWindow::voltage, std::array<Column, 3>{beside, &MotionWindow::speed, direction});
  return {w.current ? s[0] : Share{}, s[1]};
}

}  // namespace emtb
