#include "analysis/check/angle_leaps.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "analysis/check/readings.h"

namespace emtb {

DataFindings angle_leaps(const Run& run) {
  constexpr double many = 8;          // times as far as in any other row
  constexpr double counts = 10;       // at the least
  constexpr double gap = 3;           // rows
  constexpr std::size_t moving = 50;  // rows in which it turns, to say how far it goes in one
  if (!run.has(Signal::theta)) return {};
  const Series& theta = run.at(Signal::theta);
  const std::vector<double>& x = theta.value;
  if (x.size() < moving) return {};
  std::vector<double> changes;
  for (std::size_t k = 0; k + 1 < x.size(); ++k) changes.push_back(std::abs(x[k + 1] - x[k]));
  // Over a gap it goes on unseen.
  const double usual = (theta.t.back() - theta.t.front()) / static_cast<double>(changes.size());
  for (std::size_t k = 0; k < changes.size(); ++k) {
    if (theta.t[k + 1] - theta.t[k] > gap * usual) changes[k] = 0;
  }
  const auto largest = std::ranges::max_element(changes);
  const auto leap = static_cast<std::size_t>(largest - changes.begin());
  double other = 0;
  std::size_t turns = 0;
  for (std::size_t k = 0; k < changes.size(); ++k) {
    if (k == leap) continue;
    other = std::max(other, changes[k]);
    turns += changes[k] > 0 ? 1 : 0;
  }
  if (turns < moving || *largest < std::max(many * other, counts * step_of(theta))) return {};
  const double at = theta.t[leap + 1];
  const bool early = leap < x.size() / 20;
  return {{run.name, Signal::theta, Flaw::spikes, theta.t[leap], at,
           "theta leaps by " + short_number(x[leap + 1] - x[leap]) + " rad in one row, at " + short_number(at) +
               " s, " + short_number(*largest / other) + " times as far as in any other, which no shaft does: " +
               (early ? "leave out the rows before it" : "split the run there"),
           true}};
}

}  // namespace emtb
