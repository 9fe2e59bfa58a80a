#include "analysis/numerics/scatter.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "analysis/numerics/statistics.h"

namespace emtb {
namespace {

/// The standard deviation of normal deviations, by the mean square of those within three of them: what lies beyond is
/// no noise.
/// @param about what it may be
double clipped_sigma(std::span<const double> sizes, double about) {
  constexpr double within = 3, kept = 0.9733;  // of a normal distribution's variance lies within three sigma
  for (int n = 0; n < 5; ++n) {
    double squares = 0, count = 0;
    for (const double size : sizes) {
      if (size > within * about) continue;
      squares += size * size;
      count += 1;
    }
    if (squares <= 0) return 0;
    about = std::sqrt(squares / count / kept);
  }
  return about;
}

/// The standard deviation of normal deviations, by the least fifth of them: a load that comes and goes has an edge
/// between most readings that are far apart, but not between all.
double sigma_of_least(std::vector<double> sizes) {
  constexpr double share = 0.2, quantile = 0.2533;  // of the magnitudes of a standard normal
  const auto at = sizes.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(sizes.size()));
  std::ranges::nth_element(sizes, at);
  return *at / quantile;
}

/// Standard deviation of x[k + lag] - 2 x[k] + x[k - lag].
/// @param step of the instrument: a median of few steps is a whole number of them and tells little; then the mean
/// square of all but edges
double second_difference(std::span<const double> x, std::size_t lag, double step) {
  constexpr double few = 3;      // steps: by hand (ColouredNoise.IsFoundBehindStepsAsLargeAsItself)
  constexpr double edges = 0.5;  // of one distribution both are the same
  std::vector<double> sizes;
  sizes.reserve(x.size());
  for (std::size_t k = lag; k + lag < x.size(); ++k) sizes.push_back(std::abs(x[k + lag] - 2 * x[k] + x[k - lag]));
  if (sizes.empty()) return 0;
  const double by_median = robust_sigma(sizes), by_least = sigma_of_least(sizes);
  const double robust = by_least < edges * by_median ? clipped_sigma(sizes, by_least) : by_median;
  return robust > few * step ? robust : clipped_sigma(sizes, std::max(robust, step));
}

/// What a second difference over a lag makes of noise, as that of one sample.
/// @param least what sigma is at the least: the instrument's step/sqrt(12)
double scatter_over(std::span<const double> x, std::size_t lag, double least) {
  return second_difference(x, lag, std::sqrt(12.0) * least) / std::sqrt(6.0);
}

/// Over which noise has forgotten itself.
std::size_t longest_lag(std::span<const double> x) {
  constexpr std::size_t many = 100;  // readings: by hand, longer than the memory of noise at 0.97 (ColouredNoise.*)
  return std::max<std::size_t>(1, std::min(many, x.size() / 8));
}

}  // namespace

double ColouredNoise::of_mean(double n) const {
  const double rho = autocorrelation;
  const double factor = (1 + rho) / (1 - rho) - 2 * rho * (1 - std::pow(rho, n)) / (n * (1 - rho) * (1 - rho));
  return sigma * std::sqrt(std::max(1.0, factor) / n);
}

ColouredNoise coloured_noise(std::span<const double> x, double least) {
  // Noise grows no faster than a walk does, by the root of the lag; what does, from any lag on, is how the series
  // moves.
  constexpr double as_a_walk = 1.2;
  struct Scatter {
    std::size_t lag;
    double sigma;
  };
  std::vector<Scatter> by_lag;  // the longest first
  for (std::size_t lag = longest_lag(x); lag > 1; lag /= 2) by_lag.push_back({lag, scatter_over(x, lag, least)});
  const double white = std::max(scatter_over(x, 1, least), least);
  by_lag.push_back({1, white});
  const auto moves = [&](auto longer) {
    return std::any_of(longer + 1, by_lag.cend(), [&](const Scatter& shorter) {
      const double ratio = static_cast<double>(longer->lag) / static_cast<double>(shorter.lag);
      return longer->sigma > as_a_walk * std::sqrt(ratio) * shorter.sigma;
    });
  };
  auto of_noise = by_lag.cbegin();
  while (moves(of_noise)) ++of_noise;
  const double all = std::max(of_noise->sigma, white);
  if (all <= 0) return {};
  // For white noise the variance of a second difference is 6 sigma^2; for autocorrelation rho, over one sample,
  // (6 - 8 rho + 2 rho^2) sigma^2, and over many again 6 sigma^2.
  const double ratio = white * white / (all * all);
  return {all, std::clamp(2 - std::sqrt(1 + 3 * ratio), 0.0, 0.99)};
}

ColouredNoise white_noise(std::span<const double> x) { return {second_difference(x, 1, 0) / std::sqrt(6.0), 0}; }

double difference_scatter(std::span<const double> x) {
  if (x.size() < 2) return 0;
  std::vector<double> differences;
  differences.reserve(x.size());
  double squares = 0;
  for (std::size_t k = 1; k < x.size(); ++k) {
    differences.push_back(std::abs(x[k] - x[k - 1]));
    squares += differences.back() * differences.back();
  }
  const double robust = robust_sigma(differences) / std::sqrt(2.0);
  if (robust > 0) return robust;
  // A coarse grid: most readings repeat. A constant (the reference itself) has edges only, and they are not noise.
  const auto changes = static_cast<double>(std::ranges::count_if(differences, [](double d) { return d > 0; }));
  constexpr double edges = 0.05;  // share of the readings that may change: by hand (DifferenceScatter.*)
  const bool steps_only = changes < edges * static_cast<double>(differences.size());
  return steps_only ? 0 : std::sqrt(squares / static_cast<double>(differences.size()) / 2);
}

double scatter_of_differences(std::span<const double> x, std::size_t order) {
  std::vector<double> d(x.begin(), x.end());
  double weights = 1;
  for (std::size_t m = 1; m <= order; ++m) {
    for (std::size_t k = 0; k + 1 < d.size(); ++k) d[k] = d[k + 1] - d[k];
    d.pop_back();
    const auto of = static_cast<double>(m);
    weights *= (2.0 * of) * (2.0 * of - 1) / (of * of);
  }
  for (double& v : d) v = std::abs(v);
  return robust_sigma(std::move(d)) / std::sqrt(weights);
}

}  // namespace emtb
