#include "analysis/fit/phase_knots.h"

#include <algorithm>
#include <cmath>

namespace emtb {
namespace {

constexpr double knot_interval = 0.5;  // [s]: noise of 0.3 rad/s at 1 kHz lets the angle wander 0.007 rad in it

}  // namespace

Knots::Knots(const Record& record, std::size_t count) : record_(record), count_(std::max<std::size_t>(1, count)) {
  const std::vector<double>& t = record.excitation.t;
  start_ = t.front();
  if (count_ < 2) return;
  interval_ = (t.back() - start_) / static_cast<double>(count_ - 1);
  stiffness_ = 1 / (record.angle_wander * interval_);
}

std::size_t Knots::wanted(const Record& record, double order) {
  constexpr double little = 0.5;  // [rad] of its period
  const double span = record.excitation.t.back() - record.excitation.t.front();
  if (order * std::sqrt(record.angle_wander * span) < little || span < knot_interval) return 1;
  return static_cast<std::size_t>(std::ceil(span / knot_interval)) + 1;
}

Knots::Place Knots::of(double t) const {
  if (count_ < 2) return {};
  const double at = std::clamp((t - start_) / interval_, 0.0, static_cast<double>(count_ - 1));
  const std::size_t knot = std::min(static_cast<std::size_t>(at), count_ - 2);
  return {knot, at - static_cast<double>(knot)};
}

std::vector<Knots::Place> Knots::of(const Residuals& r) const {
  const Observation& o = *record_.find(r.signal);
  const std::vector<double>& t = record_.excitation.t;
  std::vector<Place> places;
  places.reserve(o.size());
  for (std::size_t i = 0; i < o.size(); ++i) places.push_back(of(0.5 * (t[o.first[i]] + t[o.last[i]])));
  return places;
}

double Knots::unlikely(std::span<const double> at) const {
  double squares = 0;
  for (std::size_t k = 1; k < at.size(); ++k) squares += std::pow(at[k] - at[k - 1], 2);
  return stiffness_ * squares;
}

}  // namespace emtb
