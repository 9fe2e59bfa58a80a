#include "analysis/numerics/orders.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <numeric>
#include <optional>

#include "analysis/numerics/parallel.h"
#include "analysis/numerics/real_transform.h"
#include "analysis/numerics/statistics.h"
#include "analysis/numerics/wave_sums.h"

namespace emtb {
namespace {

constexpr double two_pi = 2 * std::numbers::pi;
constexpr double bins_per_period = 5;  ///< of the highest order: it then loses 6 % of its power
constexpr std::size_t longest_spectrum = std::size_t{1} << 21;  ///< bins: some 40 MB
constexpr std::size_t shortest_spectrum = 1024;                 ///< bins

// By hand, held by StrongOrders.* where nothing else is said.
constexpr std::size_t fewest_readings = 16;  ///< of a stretch
constexpr double fewest_periods = 3;         ///< of the lowest order in a stretch
constexpr double rounding = 1e-20;           ///< of the squares of what does not vary: ten digits of each reading
constexpr double collinear = 1e-6;           ///< sine and cosine of an order at readings that do not tell them apart
constexpr double surroundings = 0.25;        ///< of an order, to each side: whose median is what chance does there
constexpr std::size_t tell_a_median = 199;   ///< of the surroundings, at the most
constexpr std::size_t fewest_around = 9;     ///< of the surroundings
constexpr std::size_t most_peaks = 12;       ///< peaks, the strongest first
constexpr double smoothest = 0.3;  ///< of the power of white noise: what is below is no peak, whatever its colour

/// Power over the order, summed over all stretches, each weighed by its own variance.
struct Spectrum {
  std::vector<double> power;  ///< of noise: as many as there are stretches
  double step = 0;            ///< [1/turn] from one to the next
  double stretches = 0;
};

double mean_of(std::span<const double> x) {
  return std::accumulate(x.begin(), x.end(), 0.0) / static_cast<double>(x.size());
}

/// How far a stretch goes in angle [rad].
double reach_of(const TurningStretch& s) {
  const auto [low, high] = std::ranges::minmax(s.angle);
  return high - low;
}

bool turns_enough(const TurningStretch& s, double lowest) {
  return s.value.size() >= fewest_readings && reach_of(s) >= fewest_periods * two_pi / lowest;
}

/// Sum of the squares about the mean; 0 where that is rounding alone.
double squares_of(const TurningStretch& s) {
  const double mean = mean_of(s.value);
  double squares = 0;
  for (const double v : s.value) squares += (v - mean) * (v - mean);
  return squares > rounding * mean * mean * static_cast<double>(s.value.size()) ? squares : 0;
}

/// Power of one stretch in a spectrum of `size` bins, up to where it is of use.
std::vector<double> power_of(const TurningStretch& s, double bin, std::size_t size, RealTransform& transform) {
  const double mean = mean_of(s.value), low = *std::ranges::min_element(s.angle);
  std::vector<double> bins(size, 0.0);
  for (std::size_t k = 0; k < s.value.size(); ++k) {
    const auto at = static_cast<std::size_t>((s.angle[k] - low) / bin);
    if (at < size) bins[at] += s.value[k] - mean;
  }
  const std::span<const std::complex<double>> transformed = transform.of(bins);
  std::vector<double> power(size / 2);
  for (std::size_t i = 0; i < power.size(); ++i) power[i] = std::norm(transformed[i]);
  return power;
}

/// Between the points of a spectrum that is smooth from one to the next: a cubic through four of them.
double between(std::span<const double> power, double at) {
  const auto i = static_cast<std::size_t>(at);
  if (i + 2 >= power.size()) return power.back();
  const double x = at - static_cast<double>(i), a = power[i > 0 ? i - 1 : 1], b = power[i], c = power[i + 1],
               d = power[i + 2];
  return std::max(0.0, b + 0.5 * x * (c - a + x * (2 * a - 5 * b + 4 * c - d + x * (3 * (b - c) + d - a))));
}

/// A stretch of a tenth of the longest one's length tells its power at a tenth of the points; its transform is that
/// much shorter, and the points between are smooth.
Spectrum spectrum_of(std::span<const TurningStretch> stretches, double highest, RealTransforms& transforms) {
  constexpr double smooth = 8;  // points of the spectrum in the width of a line: between them a cubic errs by 0.1 %
  const double bin = two_pi / highest / bins_per_period;
  double longest = 0;
  for (const TurningStretch& s : stretches) longest = std::max(longest, reach_of(s));
  std::size_t size = shortest_spectrum;
  while (static_cast<double>(size) * bin < 2 * longest && size < longest_spectrum) size *= 2;
  Spectrum spectrum{std::vector<double>(size / 2, 0.0), two_pi / (static_cast<double>(size) * bin), 0};
  const double last = (1 + surroundings) * highest / spectrum.step + 2;  // nobody looks beyond
  const auto used = std::min(spectrum.power.size(), static_cast<std::size_t>(last));
  std::vector<std::vector<double>> powers(stretches.size());
  parallel_for(stretches.size(), [&](std::size_t k) {
    const TurningStretch& s = stretches[k];
    const double squares = squares_of(s);
    if (squares <= 0) return;
    std::size_t own = shortest_spectrum;
    while (static_cast<double>(own) * bin < smooth * reach_of(s) && own < size) own *= 2;
    powers[k] = transforms.with_one([&](RealTransform& one) { return power_of(s, bin, own, one); });
    for (double& power : powers[k]) power /= squares;
  });
  for (const std::vector<double>& power : powers) {
    if (power.empty()) continue;
    const double step = static_cast<double>(power.size()) / static_cast<double>(spectrum.power.size());
    for (std::size_t i = 0; i < used; ++i) {
      spectrum.power[i] += step == 1 ? power[i] : between(power, static_cast<double>(i) * step);
    }
    spectrum.stretches += 1;
  }
  return spectrum;
}

/// Sine and cosine of an order at each reading, less their means.
Eigen::MatrixXd waves(const TurningStretch& s, double per_turn) {
  Eigen::MatrixXd w(static_cast<Eigen::Index>(s.angle.size()), 2);
  for (Eigen::Index k = 0; k < w.rows(); ++k) {
    const double angle = per_turn * s.angle[static_cast<std::size_t>(k)];
    w(k, 0) = std::sin(angle);
    w(k, 1) = std::cos(angle);
  }
  w.rowwise() -= w.colwise().mean().eval();
  return w;
}

/// What waves of an order explain: squares, and the square of their amplitude.
struct Share {
  double squares = 0, amplitude = 0;
};

struct FittedWave {
  Eigen::Vector2d size = Eigen::Vector2d::Zero();  ///< of sine and cosine
  double squares = 0;                              ///< that they explain
};

FittedWave fitted_wave(const TurningStretch& s, double per_turn) {
  const WaveSums w = wave_sums(s.angle, s.value, per_turn);
  const double n = static_cast<double>(s.angle.size());
  Eigen::Matrix2d information;  // about the means
  information(0, 0) = w.sine_sine - w.sine * w.sine / n;
  information(1, 1) = w.cosine_cosine - w.cosine * w.cosine / n;
  information(0, 1) = information(1, 0) = w.sine_cosine - w.sine * w.cosine / n;
  if (information.determinant() <= collinear * information(0, 0) * information(1, 1)) return {};
  const Eigen::Vector2d product(w.sine_value - w.sine * w.value / n, w.cosine_value - w.cosine * w.value / n);
  const Eigen::Vector2d size = information.inverse() * product;
  return {size, size.dot(product)};
}

Share share_of(const TurningStretch& s, double per_turn) {
  const FittedWave wave = fitted_wave(s, per_turn);
  return {wave.squares, wave.size.squaredNorm()};
}

/// What they explain of all.
Share share_of(std::span<const TurningStretch> stretches, double per_turn) {
  std::vector<Share> each(stretches.size());
  parallel_for(stretches.size(), [&](std::size_t k) { each[k] = share_of(stretches[k], per_turn); });
  Share sum;
  for (const Share& one : each) {
    sum.squares += one.squares;
    sum.amplitude += one.amplitude;
  }
  return sum;
}

/// Does an order explain far more than the orders beside it in at least half of the stretches? Noise is coloured, and a
/// stretch's own neighbourhood is the only measure of what chance does there.
bool clear_in_half(std::span<const TurningStretch> stretches, double per_turn) {
  constexpr double far_more = 8;  // of two squares over the mean of sixteen: one in 250 by chance
  std::size_t clear_ones = 0, looked_at = 0;
  for (const TurningStretch& s : stretches) {
    const double line = two_pi / reach_of(s);  // the width of a line in this stretch
    double beside = 0;
    int count = 0;
    for (const double away : {-5.5, -4.5, -3.5, -2.5, 2.5, 3.5, 4.5, 5.5}) {
      if (per_turn + away * line < line) continue;
      beside += share_of(s, per_turn + away * line).squares;
      ++count;
    }
    if (count > 0 && share_of(s, per_turn).squares > far_more * beside / count) ++clear_ones;
    ++looked_at;
    if (2 * clear_ones >= stretches.size()) return true;
    if (2 * (clear_ones + stretches.size() - looked_at) < stretches.size()) return false;
  }
  return false;
}

/// The order near `start` that explains most, by golden section.
double refined(std::span<const TurningStretch> stretches, double start, double reach) {
  constexpr double golden = 0.6180339887498949;  // 1/(golden ratio): each step keeps one of its two points
  double a = start - reach, b = start + reach;
  double c = b - golden * (b - a), d = a + golden * (b - a);
  double at_c = share_of(stretches, c).squares, at_d = share_of(stretches, d).squares;
  for (int i = 0; i < 12; ++i) {
    if (at_c > at_d) {
      b = d, d = c, at_d = at_c;
      at_c = share_of(stretches, c = b - golden * (b - a)).squares;
    } else {
      a = c, c = d, at_c = at_d;
      at_d = share_of(stretches, d = a + golden * (b - a)).squares;
    }
  }
  return 0.5 * (a + b);
}

/// The strongest order that stands out of its surroundings and is clear in at least half of the stretches.
std::optional<Order> strongest(std::span<const TurningStretch> stretches, double lowest, double highest,
                               RealTransforms& transforms) {
  const Spectrum spectrum = spectrum_of(stretches, highest, transforms);
  const std::vector<double>& power = spectrum.power;
  const auto index = [&](double order) {
    return std::min(power.size() - 1, static_cast<std::size_t>(std::max(0.0, order / spectrum.step)));
  };
  // Chance: each bin is a sum of as many exponentials as there are stretches; the largest of 10^5 stays below this.
  const double enough = 1 + 6 / std::sqrt(spectrum.stretches) + 20 / spectrum.stretches;
  struct Peak {
    double power;
    Order order;
  };
  std::vector<Peak> peaks;
  std::vector<double> around;
  for (std::size_t i = std::max<std::size_t>(1, index(lowest)); i + 1 < index(highest); ++i) {
    if (power[i] < power[i - 1] || power[i] < power[i + 1]) continue;
    if (power[i] < enough * smoothest * spectrum.stretches) continue;  // cheap first
    const double order = static_cast<double>(i) * spectrum.step;
    const std::size_t from = index((1 - surroundings) * order), to = index((1 + surroundings) * order) + 1;
    around.clear();  // as many as tell a median
    for (std::size_t k = from; k < to; k += 1 + (to - from) / tell_a_median) around.push_back(power[k]);
    const auto excess_over = [&](double beside) { return power[i] / std::max(beside, 1e-300); };
    // Half of them so far below it tell that their median is, without an order among them.
    const auto low = std::ranges::count_if(around, [&](double beside) { return excess_over(beside) > enough; });
    if (around.size() < fewest_around || static_cast<std::size_t>(low) <= around.size() / 2) continue;
    peaks.push_back({power[i], {order, 0, excess_over(median(around))}});
  }
  std::ranges::sort(peaks, std::greater{}, &Peak::power);
  for (std::size_t k = 0; k < std::min(most_peaks, peaks.size()); ++k) {
    Order found = peaks[k].order;
    found.per_turn = refined(stretches, found.per_turn, spectrum.step);
    // At one speed, slow changes appear at the order of the sampling. At others that is another order.
    if (!clear_in_half(stretches, found.per_turn)) continue;
    found.amplitude = std::sqrt(share_of(stretches, found.per_turn).amplitude / static_cast<double>(stretches.size()));
    return found;
  }
  return std::nullopt;
}

}  // namespace

std::vector<double> without_slow_changes(std::vector<double> x, double interval) {
  constexpr double half = 0.25;  // [s] half of what counts as slow
  const auto reach = static_cast<std::size_t>(std::max(2.0, std::round(half / interval)));
  std::vector<double> sum(x.size() + 1, 0.0);
  std::partial_sum(x.begin(), x.end(), sum.begin() + 1);
  for (std::size_t k = 0; k < x.size(); ++k) {
    const std::size_t from = k > reach ? k - reach : 0, to = std::min(x.size(), k + reach + 1);
    x[k] -= (sum[to] - sum[from]) / static_cast<double>(to - from);
  }
  return x;
}

Wave wave_of(const TurningStretch& stretch, double per_turn) {
  const double squares = squares_of(stretch);
  if (squares <= 0) return {};
  const FittedWave wave = fitted_wave(stretch, per_turn);
  return {wave.size[0], wave.size[1], wave.squares / squares};
}

void remove_orders(TurningStretch& stretch, std::span<const Order> orders) {
  for (const Order& order : orders) {
    const Eigen::MatrixXd w = waves(stretch, order.per_turn);
    Eigen::Map<Eigen::VectorXd> y(stretch.value.data(), w.rows());
    const Eigen::Matrix2d information = w.transpose() * w;
    if (information.determinant() <= collinear * information(0, 0) * information(1, 1)) continue;
    y -= w * (information.inverse() * (w.transpose() * y));
  }
}

std::vector<Order> strong_orders(std::span<const TurningStretch> all, std::size_t at_most, double lowest,
                                 double highest) {
  std::vector<TurningStretch> stretches;
  for (const TurningStretch& s : all) {
    if (turns_enough(s, lowest) && squares_of(s) > 0) stretches.push_back(s);
  }
  std::vector<Order> orders;
  RealTransforms transforms;
  while (!stretches.empty() && orders.size() < at_most) {
    const std::optional<Order> found = strongest(stretches, lowest, highest, transforms);
    if (!found) break;
    orders.push_back(*found);
    // Out it goes, with its skirts and with what the sampling mirrors of it.
    parallel_for(stretches.size(), [&](std::size_t k) { remove_orders(stretches[k], std::span(&*found, 1)); });
    std::erase_if(stretches, [](const TurningStretch& s) { return squares_of(s) <= 0; });
  }
  return orders;
}

}  // namespace emtb
