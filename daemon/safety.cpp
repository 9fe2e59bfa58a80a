#include "daemon/safety.h"

#include <algorithm>
#include <cmath>

namespace emtb {

bool Safety::trip(const Trip& trip) noexcept {
  armed_ = false;
  if (cause_ || !trip) return false;
  cause_ = trip;
  return true;
}

void Safety::clear() noexcept {
  armed_ = false;
  cause_ = {};
}

Trip Safety::judge(const Reading& reading) const noexcept {
  const auto beyond = [&](const std::optional<double>& limit, Fault fault) {
    return limit && std::abs(reading.value) > *limit ? Trip{fault, reading.signal, reading.value} : Trip{};
  };
  if (!std::isfinite(reading.value) || !std::isfinite(reading.time)) {
    return {Fault::non_finite, reading.signal, reading.value};
  }
  switch (reading.signal) {
    case Signal::omega:
      return beyond(limits_.omega, Fault::over_speed);
    case Signal::i_a:
      return beyond(limits_.i_a, Fault::over_current);
    case Signal::torque:
      return beyond(limits_.torque, Fault::over_torque);
    default:
      return {};
  }
}

Trip Safety::judge_run_time(double t) const noexcept {
  return limits_.time && t > *limits_.time ? Trip{Fault::run_too_long, std::nullopt, t} : Trip{};
}

double Safety::shape(double wanted, double previous, double dt) const noexcept {
  if (!std::isfinite(wanted) || !std::isfinite(previous) || !std::isfinite(dt)) return reference_.safe;
  const double within = std::clamp(wanted, reference_.min, reference_.max);
  if (rate_ <= 0) return within;
  const double step = rate_ * std::max(dt, 0.0);
  return std::clamp(std::clamp(within, previous - step, previous + step), reference_.min, reference_.max);
}

}  // namespace emtb
