#include "analysis/check/begins_anew.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "analysis/check/readings.h"

namespace emtb {
namespace {

/// How often it jumps by more than half a turn while it stays within one.
std::size_t jumps_within_a_turn(const Series& theta) {
  constexpr double turn = 2 * std::numbers::pi, rounding = 1e-3, filled = 0.9;
  const auto [low, high] = std::ranges::minmax(theta.value);
  if (high - low > turn * (1 + rounding) || high - low < filled * turn) return 0;
  std::size_t jumps = 0;
  for (std::size_t k = 1; k < theta.value.size(); ++k) {
    if (std::abs(theta.value[k] - theta.value[k - 1]) > 0.5 * turn) ++jumps;
  }
  return jumps;
}

}  // namespace

DataFindings begins_anew(std::span<const Run> runs) {
  constexpr std::size_t often = 3;
  DataFindings findings;
  double after = 0;
  for (const Run& run : runs) {
    if (!run.has(Signal::theta) || run.at(Signal::theta).value.empty()) continue;
    const Series& theta = run.at(Signal::theta);
    after = std::max(after, theta.begins_anew_after);
    if (theta.begins_anew_after > 0 || jumps_within_a_turn(theta) < often) continue;
    findings.push_back(
        {run.name, Signal::theta, Flaw::angle_speed, 0, run.duration(),
         "theta begins anew with each turn, but from row to row the shaft turns so far, or so unevenly, that "
         "nothing tells how many: log it faster, or log the speed beside it",
         true});
  }
  if (after > 0) {
    findings.push_back({"", Signal::theta, Flaw::angle_speed, 0, 0,
                        "theta begins anew after each " + short_number(after) + " rad: it was put together", false});
  }
  return findings;
}

}  // namespace emtb
