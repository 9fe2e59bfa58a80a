#include "analysis/check/lost_sign.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "analysis/check/readings.h"
#include "analysis/numerics/regression.h"

namespace emtb {
namespace {

/// The scatter that acceleration, friction and a constant load leave of a current.
double scatter_of(const std::vector<double>& current, const MotionWindows& w) {
  std::vector<std::vector<double>> columns(4);
  for (const MotionWindow& m : w.all) {
    columns[0].push_back(m.acceleration);
    columns[1].push_back(m.speed);
    columns[2].push_back(m.speed > 0 ? 1 : -1);
    columns[3].push_back(1);
  }
  std::erase_if(columns, [](std::vector<double>& column) {
    const double largest = size_of(column);
    for (double& x : column) x /= largest;
    return !(largest > 0);
  });
  return regress(columns, current).scatter;
}

/// So many windows in which the motor turns well one way, and is driven by what `drives` says of the voltage.
template <class Drives>
std::size_t turning(const MotionWindows& w, double way, const Drives& drives) {
  double fastest = 0;
  for (const MotionWindow& m : w.all) fastest = std::max(fastest, std::abs(m.speed));
  return static_cast<std::size_t>(std::ranges::count_if(
      w.all, [&](const MotionWindow& m) { return way * m.speed > 0.3 * fastest && drives(m.voltage); }));
}

/// The same, where the voltage has the sign of the speed.
std::size_t driven(const MotionWindows& w, double way) {
  return turning(w, way, [&](double voltage) { return way * voltage > 0; });
}

}  // namespace

bool never_below_zero(const MotionWindows& w) {
  constexpr double never_below = 0.05;  // of the largest reading: an offset, and noise
  const auto [lowest, highest] = std::ranges::minmax(w.all, {}, &MotionWindow::current);
  return highest.current > 0 && lowest.current >= -never_below * highest.current;
}

DataFindings drive_without_sign(const MotionWindows& w, const std::string& run, double duration) {
  constexpr std::size_t enough = 5;  // windows
  constexpr double clearly = 0.2;    // of the highest voltage
  if (!w.voltage || !w.speed || w.all.empty()) return {};
  const auto [lowest, highest] = std::ranges::minmax(w.all, {}, &MotionWindow::voltage);
  if (lowest.voltage < 0 || !(highest.voltage > 0)) return {};
  const auto drives = [most = highest.voltage](double voltage) { return voltage > clearly * most; };
  if (turning(w, 1, drives) < enough || turning(w, -1, drives) < enough) return {};
  return {{run, w.voltage, Flaw::sign, 0, duration,
           name_of(*w.voltage) +
               " is never negative though the shaft turns both ways under it: if the driver reverses, which way is not "
               "in the file. Give it the sign that it had, negative where it drives backwards",
           false}};
}

DataFindings lost_sign(const MotionWindows& w, const std::string& run, double duration) {
  constexpr std::size_t enough = 10;  // windows
  constexpr double clearly = 0.5;     // of the square of what is left
  if (!w.voltage || !w.current || w.all.size() < 4 * enough) return {};
  if (driven(w, 1) < enough || driven(w, -1) < enough || !never_below_zero(w)) return {};
  std::vector<double> as_logged, with_sign;
  for (const MotionWindow& m : w.all) {
    as_logged.push_back(m.current);
    with_sign.push_back(std::copysign(m.current, m.voltage));
  }
  if (scatter_of(with_sign, w) > std::sqrt(clearly) * scatter_of(as_logged, w)) return {};
  return {{run, Signal::i_a, Flaw::sign, 0, duration,
           "i_a is never negative though " + name_of(*w.voltage) +
               " drives the motor both ways: only its size was logged. Give it the sign that it had, or leave it out",
           true}};
}

}  // namespace emtb
