#include "analysis/numerics/ringing.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <numeric>

#include "analysis/numerics/real_transform.h"
#include "analysis/numerics/statistics.h"

namespace emtb {
namespace {

// By hand, held by Ringing.* where nothing else is said.
constexpr double segment = 4;                 // [s] of which a spectrum is made: a quarter of a hertz from line to line
constexpr double lowest = 1.5;                // [Hz] below, all that settles looks like it
constexpr double stands_out = 5;              // times the median of its surroundings
constexpr double highest_share = 0.2;         // of the sampling rate: five readings a period
constexpr std::size_t fewest_readings = 100;  // of the longest series
constexpr std::size_t fewest_around = 5;      // lines whose median is a level

/// The power of all series, segment by segment, which overlap by half.
std::vector<double> power_of(std::span<const std::vector<double>> series, std::size_t size) {
  std::vector<double> power(size / 2, 0.0);
  RealTransform transform;
  for (const std::vector<double>& x : series) {
    for (std::size_t from = 0; from == 0 || from + size / 2 < x.size(); from += size / 2) {
      std::vector<double> piece(size, 0.0);
      const std::size_t n = std::min(size, x.size() - from);
      for (std::size_t k = 0; k < n; ++k) {
        const double hann =
            0.5 - 0.5 * std::cos(2 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(n));
        piece[k] = hann * x[from + k];
      }
      const std::span<const std::complex<double>> transformed = transform.of(piece);
      for (std::size_t i = 0; i < power.size(); ++i) power[i] += std::norm(transformed[i]);
    }
  }
  return power;
}

}  // namespace

double ringing_frequency(std::span<const std::vector<double>> series, double interval) {
  std::size_t longest = 0, size = 64;
  for (const std::vector<double>& x : series) longest = std::max(longest, x.size());
  if (longest < fewest_readings) return 0;
  while (static_cast<double>(size) * interval < segment && size < 2 * longest) size *= 2;
  const std::vector<double> raw = power_of(series, size);
  std::vector<double> sum(raw.size() + 1, 0.0), power(raw.size(), 0.0);
  std::partial_sum(raw.begin(), raw.end(), sum.begin() + 1);
  for (std::size_t i = 1; i < raw.size(); ++i) {  // as wide as the line of something that is damped by a thirtieth
    const std::size_t reach = 1 + i / 30, from = i > reach ? i - reach : 0, to = std::min(raw.size(), i + reach + 1);
    power[i] = (sum[to] - sum[from]) / static_cast<double>(to - from);
  }
  const double step = 1 / (static_cast<double>(size) * interval);  // [Hz]
  const auto first = static_cast<std::size_t>(std::ceil(lowest / step));
  const auto last = std::min(static_cast<std::size_t>(highest_share * static_cast<double>(size)), power.size() / 2);
  double best = stands_out, frequency = 0;
  for (std::size_t i = first; i < last; ++i) {
    std::vector<double> around;
    for (std::size_t k = i / 2; k < 2 * i; ++k) {  // an octave to each side, but for a fifth around itself
      if (5 * k < 4 * i || 4 * k > 5 * i) around.push_back(power[k]);
    }
    if (around.size() < fewest_around) continue;
    const double excess = power[i] / std::max(median(std::move(around)), 1e-300);
    if (excess > best) best = excess, frequency = static_cast<double>(i) * step;
  }
  return 2 * std::numbers::pi * frequency;
}

}  // namespace emtb
