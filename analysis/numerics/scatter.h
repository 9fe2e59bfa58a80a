#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace emtb {

/// The noise of a series that also moves: a first-order autoregression.
struct ColouredNoise {
  double sigma = 0;            ///< standard deviation of one sample
  double autocorrelation = 0;  ///< from one sample to the next, 0 to 0.99

  /// Standard deviation of the mean of n neighbours.
  double of_mean(double n) const;
};

/// The noise by the structure function: the median size of second differences over one sample and over many. A median
/// and second differences leave out edges and slopes; the shorter over the longer tells the autocorrelation. Where the
/// series itself moves all the time, over as many samples as they grow no faster over than noise that walks off.
/// @param least what sigma is at the least: the instrument's resolution, its step/sqrt(12)
ColouredNoise coloured_noise(std::span<const double> x, double least);

/// What of the noise hops from sample to sample, by second differences over one: of a series that has as many edges as
/// a long structure function has samples.
ColouredNoise white_noise(std::span<const double> x);

/// Scatter of a series by its first differences, robust against edges: 1.4826 median|x[k+1] - x[k]| / sqrt 2; where
/// most readings repeat the one before, their standard deviation. Coloured noise makes it too small.
double difference_scatter(std::span<const double> x);

/// Scatter by differences of some order, which a smooth movement of the series leaves out: 1.4826 median|d^m x| over
/// the root of the sum of the squares of the weights, (2m)!/(m!)^2.
/// @param order less than there are readings
double scatter_of_differences(std::span<const double> x, std::size_t order);

}  // namespace emtb
