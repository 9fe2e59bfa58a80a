#include "analysis/fit/profile_likelihood.h"

#include <algorithm>
#include <cmath>

namespace emtb {
namespace {

constexpr double quantile = 3.841459;         // of chi-square with one degree of freedom, 95 %
constexpr double normal_quantile = 1.959964;  // its root
constexpr double near_enough = 0.03;          // of the distance to the end of the interval
constexpr int steps_to_a_side = 12;

/// Walks from the optimum to where the cost has risen as far as the data allow.
class Walk {
 public:
  Walk(std::span<const Record> records, const Calibration& fitted, std::size_t place, const CalibrationOptions& options,
       double allowed)
      : records_(records), fitted_(fitted), place_(place), options_(options), allowed_(allowed) {
    options_.extra_starts = 0;
    options_.with_covariance = false;
    options_.tolerance = 1e-8;
  }

  struct End {
    double value = 0;
    bool at_bound = false;
  };

  /// @param step [SI] with its sign: about as far as the end is thought to be
  End end(double step) const {
    const Parameter& p = fitted_.model.at(place_);
    const double bound = step > 0 ? p.max : p.min;
    const double room = std::abs(bound - p.value);
    const double sign = step > 0 ? 1 : -1;
    if (room <= 0) return {bound, true};
    Model from = fitted_.model;  // the others as they were at the last point: a short way to go
    double at = std::min(std::abs(step), room), inside = 0, outside = room * 2;
    for (int n = 0; n < steps_to_a_side; ++n) {
      from.at(place_).value = p.value + sign * at;
      from.at(place_).fixed = true;
      const Calibration c = calibrate(records_, from, options_);
      const double rise = c.cost - fitted_.cost;
      // The root of the rise grows with the distance, in proportion where the likelihood is a normal one.
      const double share = std::sqrt(std::max(0.0, rise) / allowed_);
      if (std::abs(share - 1) < near_enough) return {p.value + sign * at, false};
      if (share < 1) {
        if (at >= room) return {bound, true};
        inside = at;
        from = c.model;
      } else {
        outside = at;
      }
      double next = at / std::clamp(share, 0.2, 5.0);
      if (!(next > inside && next < outside)) next = 0.5 * (inside + std::min(outside, room));
      at = std::min(next, room);
    }
    return {p.value + sign * at, false};
  }

 private:
  std::span<const Record> records_;
  const Calibration& fitted_;
  std::size_t place_;
  CalibrationOptions options_;
  double allowed_;
};

}  // namespace

std::optional<LikelihoodInterval> profile_likelihood(std::span<const Record> records, const Calibration& fitted,
                                                     std::size_t place, const CalibrationOptions& options) {
  const FreeParameters free(fitted.model);
  const auto places = free.places();
  const auto found = std::ranges::find(places, place);
  if (found == places.end()) return std::nullopt;
  const auto i = static_cast<Eigen::Index>(found - places.begin());
  if (fitted.inflation.size() != static_cast<Eigen::Index>(places.size()) || !(fitted.inflation[i] > 0)) {
    return std::nullopt;
  }
  const Parameter& p = fitted.model.at(place);
  const double error = p.std_error.value_or(fitted.alone[i]);
  const Walk walk(records, fitted, place, options, 0.5 * quantile * fitted.inflation[i]);
  const Walk::End low = walk.end(-normal_quantile * error), high = walk.end(normal_quantile * error);
  return LikelihoodInterval{low.value, high.value, low.at_bound, high.at_bound};
}

LikelihoodIntervals profile_likelihoods(std::span<const Record> records, const Calibration& fitted,
                                        const CalibrationOptions& options) {
  LikelihoodIntervals all;
  const std::vector<std::string> names = fitted.model.names();
  for (std::size_t place = 0; place < names.size(); ++place) {
    if (const auto one = profile_likelihood(records, fitted, place, options)) all[names[place]] = *one;
  }
  return all;
}

bool misled(const Parameter& parameter, const LikelihoodInterval& interval) {
  if (!parameter.std_error) return true;
  const double reach = normal_quantile * *parameter.std_error;
  const double off =
      std::max(std::abs(parameter.value - reach - interval.low), std::abs(parameter.value + reach - interval.high));
  return off > 0.25 * (interval.high - interval.low);
}

}  // namespace emtb
