#include "session/unwind.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

namespace emtb {
namespace {

constexpr double most = 0.5;                         // of the range, by which an angle jumps that begins anew
constexpr double filled = 0.9;                       // of what it begins anew after, at least, by all runs together
constexpr double course = 0.35, nearly_all = 0.995;  // of that, by which nearly all advances differ from the last

/// The range of all readings of an angle, and the step of its instrument.
struct Range {
  double low = HUGE_VAL, high = -HUGE_VAL, step = 0;
  bool jumps = false;

  double span() const { return high - low; }
};

Range range_of(std::span<const Run* const> runs) {
  Range range;
  for (const Run* run : runs) {
    const Series& theta = run->at(Signal::theta);
    for (const double angle : theta.value)
      range.low = std::min(range.low, angle), range.high = std::max(range.high, angle);
    range.step = std::max(range.step, theta.lsb);
  }
  for (const Run* run : runs) {
    const std::vector<double>& angle = run->at(Signal::theta).value;
    for (std::size_t k = 1; k < angle.size(); ++k) {
      range.jumps = range.jumps || std::abs(angle[k] - angle[k - 1]) > most * range.span();
    }
  }
  return range;
}

/// What an angle of that range may begin anew after: a turn, or a power of two of its steps.
std::vector<double> possible_periods(const Range& range) {
  constexpr double rounding = 1e-3;
  constexpr int fewest_bits = 6, most_bits = 32;
  std::vector<double> periods;
  const auto add = [&](double period) {
    if (range.span() <= period * (1 + rounding) && range.span() >= filled * period) periods.push_back(period);
  };
  add(2 * std::numbers::pi);
  for (int bits = fewest_bits; range.step > 0 && bits <= most_bits; ++bits) add(range.step * std::exp2(bits));
  return periods;
}

/// The speed that was read beside each angle; empty: none.
std::vector<double> speeds_beside(const Run& run) {
  if (!run.has(Signal::omega) || run.at(Signal::omega).t != run.at(Signal::theta).t) return {};
  return run.at(Signal::omega).value;
}

/// The angle put together.
/// @param bends gets by how much each advance differs from what the one before it foretells, as a share of the period
std::vector<double> unwound(const Run& run, double period, std::vector<double>& bends) {
  const Series& theta = run.at(Signal::theta);
  const std::vector<double> omega = speeds_beside(run);
  std::vector<double> angle{theta.value.front()};
  double speed = 0;
  for (std::size_t k = 1; k < theta.value.size(); ++k) {
    const double interval = theta.t[k] - theta.t[k - 1];
    const double foretold = (omega.empty() ? speed : 0.5 * (omega[k - 1] + omega[k])) * interval;
    const double read = theta.value[k] - theta.value[k - 1];
    const double advance = read - period * std::round((read - foretold) / period);
    bends.push_back(std::abs(advance - foretold) / period);
    angle.push_back(angle.back() + advance);
    speed = advance / interval;
  }
  return angle;
}

bool is_a_course(std::vector<double> bends) {
  if (bends.empty()) return false;
  const auto at = bends.begin() + static_cast<std::ptrdiff_t>(nearly_all * static_cast<double>(bends.size() - 1));
  std::ranges::nth_element(bends, at);
  return *at < course;
}

}  // namespace

void unwind_angles(std::span<Run> runs) {
  std::vector<Run*> turning;
  for (Run& run : runs) {
    if (run.has(Signal::theta) && run.at(Signal::theta).value.size() > 2) turning.push_back(&run);
  }
  const Range range = range_of(turning);
  if (!range.jumps) return;
  for (const double period : possible_periods(range)) {
    std::vector<std::vector<double>> angles;
    std::vector<double> bends;
    for (const Run* run : turning) angles.push_back(unwound(*run, period, bends));
    if (!is_a_course(std::move(bends))) continue;
    for (std::size_t r = 0; r < turning.size(); ++r) {
      Series& theta = turning[r]->signals.at(Signal::theta);
      theta.value = std::move(angles[r]);
      theta.begins_anew_after = period;
    }
    return;
  }
}

}  // namespace emtb
