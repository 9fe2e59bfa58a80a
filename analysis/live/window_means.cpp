#include "analysis/live/window_means.h"

#include <algorithm>

namespace emtb {

WindowMeans::WindowMeans(const LivePlan& plan) : plan_(plan) {
  std::size_t values = 0;
  for (const auto& output : plan.outputs) {
    first_.push_back(values);
    if (output.slow) values += 2 * (1 + plan.moved.size());
  }
  if (values == 0) return;
  ring_.resize(static_cast<std::size_t>(plan.longest_window / plan.period) + 16);
  for (Entry& entry : ring_) entry.value.assign(values, 0.0);
}

void WindowMeans::add(const SimulatedMotor& motor) {
  if (ring_.empty()) return;
  const Entry& last = ring_[newest_];
  const std::size_t next = (newest_ + 1) % ring_.size();
  const double h = stored_ > 0 ? motor.t() - last.t : 0;
  ring_[next].t = motor.t();
  for (std::size_t o = 0; o < plan_.outputs.size(); ++o) {
    if (!plan_.outputs[o].slow) continue;
    const Signal signal = plan_.outputs[o].signal;
    double* to = ring_[next].value.data() + first_[o];
    const double* from = last.value.data() + first_[o];
    const auto integrate = [&](std::size_t entry, double x) {
      to[2 * entry] = stored_ == 0 ? 0 : from[2 * entry] + 0.5 * h * (from[2 * entry + 1] + x);
      to[2 * entry + 1] = x;
    };
    integrate(0, motor.reading(signal));
    for (std::size_t j = 0; j < plan_.moved.size(); ++j) integrate(1 + j, motor.derivative(signal, j));
  }
  newest_ = next;
  stored_ = std::min(stored_ + 1, ring_.size());
  if (!motor.settled()) stored_ = std::min<std::size_t>(stored_, 1);  // windows begin where the states are right
}

std::size_t WindowMeans::entry_at(double t) const {
  std::size_t at = newest_;
  for (std::size_t back = 0; back + 1 < stored_ && ring_[at].t > t; ++back) at = (at + ring_.size() - 1) % ring_.size();
  return at;
}

std::optional<double> WindowMeans::mean(const SlowReading& reading, Eigen::VectorXd& derivatives) const {
  if (stored_ < 2) return {};
  const std::size_t oldest = (newest_ + ring_.size() + 1 - stored_) % ring_.size();
  if (reading.begin < ring_[oldest].t - 0.75 * plan_.period) return {};
  if (reading.end > ring_[newest_].t + 1.5 * plan_.period) return {};
  // Linear between ticks.
  const auto interpolate = [&](double t, std::size_t entry) {
    const std::size_t low = entry_at(t), high = low == newest_ ? low : (low + 1) % ring_.size();
    const double a = ring_[low].t, b = ring_[high].t;
    const double share = b > a ? std::clamp((t - a) / (b - a), 0.0, 1.0) : 0.0;
    const std::size_t place = first_[reading.output] + 2 * entry;
    const double from = ring_[low].value[place], to = ring_[high].value[place];
    return from + share * (to - from);
  };
  const double each = 1 / (reading.end - reading.begin);
  for (std::size_t j = 0; j < plan_.moved.size(); ++j) {
    derivatives.data()[j] = (interpolate(reading.end, 1 + j) - interpolate(reading.begin, 1 + j)) * each;
  }
  return (interpolate(reading.end, 0) - interpolate(reading.begin, 0)) * each;
}

}  // namespace emtb
