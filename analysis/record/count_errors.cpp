#include "analysis/record/count_errors.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "analysis/numerics/even_series.h"

namespace emtb {
namespace {

/// Of the variance that counts leave on the average: no speed is so steady that less is left.
constexpr double least = 0.04;

/// The integral of f (1 - f) from 0 to x, f = frac(x).
double sawtooth_integral(double x) {
  const double whole = std::floor(x), f = x - whole;
  return whole / 6 + f * f * (1.0 / 2 - f / 3);
}

/// The speeds around a reading, without their sign [rad/s].
struct SpeedRange {
  double low = 0, high = 0;
};

/// The line through a few readings around each: alone, none tells the speed well enough to say where in a step the next
/// count falls.
std::vector<SpeedRange> speeds_around(std::span<const double> speed, std::span<const double> at, double window) {
  constexpr std::size_t around = 4;  // readings to either side
  std::vector<SpeedRange> ranges;
  for (std::size_t i = 0; i < speed.size(); ++i) {
    const std::size_t from = i - std::min(i, around), to = std::min(i + around, speed.size() - 1);
    const auto n = static_cast<double>(to - from + 1);
    double t = 0, w = 0, tt = 0, tw = 0, rest = 0;
    for (std::size_t k = from; k <= to; ++k) t += at[k] / n, w += speed[k] / n;
    for (std::size_t k = from; k <= to; ++k) {
      tt += (at[k] - t) * (at[k] - t);
      tw += (at[k] - t) * (speed[k] - w);
    }
    const double slope = tt > 0 ? tw / tt : 0;
    for (std::size_t k = from; k <= to; ++k) rest += std::pow(speed[k] - w - slope * (at[k] - t), 2);
    const double middle = std::abs(w + slope * (at[i] - t));
    const double off = 0.5 * std::abs(slope) * window + std::sqrt(rest / std::max(1.0, n - 2) / n);
    ranges.push_back({std::max(0.0, middle - off), middle + off});
  }
  return ranges;
}

std::vector<double> middles_of(const Observation& o) {
  std::vector<double> middle;
  for (std::size_t i = 0; i < o.size(); ++i) middle.push_back(0.5 * (o.begin[i] + o.end[i]));
  return middle;
}

}  // namespace

double count_covariance(double fewest, double most) {
  constexpr double narrow = 1e-6;  // of a step
  const double middle = 0.5 * (fewest + most);
  const double f = middle - std::floor(middle);
  const double mean =
      most - fewest < narrow ? f * (1 - f) : (sawtooth_integral(most) - sawtooth_integral(fewest)) / (most - fewest);
  return 1.0 / 12 - mean / 2;
}

void count_errors_of_slopes(Observation& o, const Series& theta, std::size_t half, const AngleNoise& noise) {
  const double interval = mean_interval(theta.t), jitter = jitter_of(theta.t), q = o.lsb;
  const double window = 2 * static_cast<double>(half) * interval;
  const auto points = static_cast<std::ptrdiff_t>(2 * half + 1), reach = static_cast<std::ptrdiff_t>(half);
  double squares = 0;
  for (std::ptrdiff_t j = -reach; j <= reach; ++j) squares += static_cast<double>(j * j);
  const auto weight = [&](std::ptrdiff_t j) { return static_cast<double>(j - reach) / (squares * interval); };
  // The products of weights by how far apart they are: within a line, and of a line and the next, `half` later.
  std::vector<double> own(static_cast<std::size_t>(points), 0.0), next(static_cast<std::size_t>(points + reach), 0.0);
  for (std::ptrdiff_t j = 0; j < points; ++j) {
    for (std::ptrdiff_t k = 0; k < points; ++k) {
      own[static_cast<std::size_t>(std::abs(j - k))] += weight(j) * weight(k);
      next[static_cast<std::size_t>(std::abs(j - k - reach))] += weight(j) * weight(k);
    }
  }
  const double white = own.front() * q * q / 12;
  const std::vector<SpeedRange> speeds = speeds_around(o.value, middles_of(o), window);
  double variances = 0, covariances = 0;
  for (const SpeedRange& speed : speeds) {
    double variance = 0, covariance = 0;
    for (std::size_t lag = 0; lag < next.size(); ++lag) {
      const double apart = static_cast<double>(lag) * interval;
      const double wide = lag == 0 ? 0 : jitter * speed.high / q;
      const double cov = q * q * count_covariance(apart * speed.low / q - wide, apart * speed.high / q + wide) +
                         (lag == 0 ? noise.variance(speed.high) : 0);
      if (lag < own.size()) variance += own[lag] * cov;
      covariance += next[lag] * cov;
    }
    if (speed.low * window < q) {
      variance += std::pow(q / (2 * window), 2);
    } else {
      variances += variance;
      covariances += covariance;
    }
    o.counted.push_back(std::max(variance, least * white));
  }
  if (variances > 0) o.counted_correlation = std::clamp(covariances / variances, -0.9, 0.9);
}

void count_errors_of_increments(Observation& o, const AngleNoise& noise) {
  const double q = o.lsb;
  std::vector<double> speed;
  for (std::size_t i = 0; i < o.size(); ++i) speed.push_back(o.value[i] / (o.end[i] - o.begin[i]));
  const double window = mean_interval(o.end);
  for (const SpeedRange& around : speeds_around(speed, middles_of(o), window)) {
    const double apart = window / q;
    double variance = 2 * noise.variance(around.high) +
                      q * q * (1.0 / 6 - 2 * count_covariance(apart * around.low, apart * around.high));
    if (around.low * window < q) variance += q * q / 4;
    o.counted.push_back(std::max(variance, least * q * q / 6));
  }
  o.counted_correlation = -0.5;  // neighbours share a count
}

}  // namespace emtb
