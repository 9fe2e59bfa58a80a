#include "analysis/record/time_scatter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "analysis/numerics/even_series.h"
#include "analysis/numerics/statistics.h"
#include "analysis/record/count_errors.h"

namespace emtb {
namespace {

constexpr std::size_t length = 32;  // readings of a piece, over which a shaft turns smoothly
constexpr std::array<std::size_t, 3> orders{3, 5, 7};

/// Weights of unit length that no polynomial of a lower degree passes, at times that may be uneven.
std::vector<double> divided_difference(std::span<const double> t) {
  std::vector<double> weight(t.size(), 1);
  double squares = 0;
  for (std::size_t j = 0; j < t.size(); ++j) {
    for (std::size_t k = 0; k < t.size(); ++k) {
      if (k != j) weight[j] *= (t.back() - t.front()) / (t[j] - t[k]);
    }
    squares += weight[j] * weight[j];
  }
  for (double& w : weight) w /= std::sqrt(squares);
  return weight;
}

/// Variance that whole counts leave in such a difference, in counts²; never less than of counts that nothing binds.
/// @param speed [counts/s] @param unknown share of it, to either side
double of_counts(std::span<const double> t, std::span<const double> weight, double speed, double unknown) {
  double variance = 0;
  for (std::size_t j = 0; j < weight.size(); ++j) {
    for (std::size_t k = 0; k < weight.size(); ++k) {
      const double apart = speed * std::abs(t[j] - t[k]);
      variance += weight[j] * weight[k] * count_covariance(apart * (1 - unknown), apart * (1 + unknown));
    }
  }
  return std::max(variance, 1.0 / 12);
}

/// Of differences of a piece: steps make their mean square too large, and counts that hop to and fro in time with the
/// readings what the middle one tells.
double variance_of(std::vector<double> sizes) {
  double squares = 0;
  for (const double size : sizes) squares += size * size / static_cast<double>(sizes.size());
  return std::min(squares, std::pow(robust_sigma(std::move(sizes)), 2));
}

/// What a piece tells, by the differences of each order.
struct Piece {
  std::array<double, orders.size()> times{};    ///< [s²] its variance beyond that of counts, over its squared speed
  std::array<double, orders.size()> beside{};   ///< the same over the variance of counts
  std::array<double, orders.size()> scatter{};  ///< in counts
};

Piece told_by(std::span<const double> t, std::span<const double> counts) {
  const double turned = std::abs(counts.back() - counts.front()), speed = turned / (t.back() - t.front());
  Piece piece;
  for (std::size_t o = 0; o < orders.size(); ++o) {
    const std::size_t points = orders[o] + 1;
    std::vector<double> sizes;
    double counted = 0;
    for (std::size_t k = 0; k + points <= length; ++k) {
      const std::span at = t.subspan(k, points);
      const std::vector<double> weight = divided_difference(at);
      double difference = 0;
      for (std::size_t j = 0; j < points; ++j) difference += weight[j] * (counts[k + j] - counts[k]);
      sizes.push_back(std::abs(difference));
      counted += of_counts(at, weight, speed, 1 / turned) / static_cast<double>(length - orders[o]);
    }
    const double variance = variance_of(std::move(sizes));
    piece.scatter[o] = std::sqrt(variance);
    piece.times[o] = (variance - counted) / (speed * speed);
    piece.beside[o] = (variance - counted) / counted;
  }
  return piece;
}

/// Pieces of a run in which each reading is some counts from the one before.
void collect(const Series& theta, std::vector<Piece>& pieces) {
  constexpr double fewest_counts = 2;  // a reading: with fewer, the counts hide what times do
  for (std::size_t from = 0; from + length <= theta.t.size(); from += length) {
    const std::span t = std::span(theta.t).subspan(from, length);
    std::vector<double> counts;
    for (const double angle : std::span(theta.value).subspan(from, length)) counts.push_back(angle / theta.lsb);
    const double turned = std::abs(counts.back() - counts.front());
    if (turned >= fewest_counts * (length - 1)) pieces.push_back(told_by(t, counts));
  }
}

/// [s] As far as times can be off: their last digit, though never by much of the time between two, where a clock
/// writes even ones and all digits behind them are 0; or as far as they are uneven.
double most_that_times_are_off(std::span<const double> t) {
  constexpr double of_an_interval = 0.05;
  return std::max(std::min(last_digit_of(t), of_an_interval * mean_interval(t)), jitter_of(t));
}

}  // namespace

double time_scatter(std::span<const Run> runs, std::span<const Run> others) {
  constexpr std::size_t fewest = 3;                // pieces
  constexpr double clearly = 1, like_noise = 0.6;  // of the scatter of counts; of what differs between the orders
  std::vector<Piece> pieces;
  double most = 0;
  for (const std::span<const Run> some : {runs, others}) {
    for (const Run& run : some) {
      if (!run.has(Signal::theta) || run.at(Signal::theta).lsb <= 0) continue;
      const Series& theta = run.at(Signal::theta);
      if (theta.t.size() < length) continue;
      collect(theta, pieces);
      most = std::max(most, most_that_times_are_off(theta.t));
    }
  }
  if (pieces.size() < fewest) return 0;
  const auto usual = [&](std::array<double, orders.size()> Piece::*what) {  // of each order
    std::array<double, orders.size()> values{};
    for (std::size_t o = 0; o < orders.size(); ++o) {
      std::vector<double> of_pieces;
      for (const Piece& piece : pieces) of_pieces.push_back((piece.*what)[o]);
      values[o] = median(std::move(of_pieces));
    }
    return values;
  };
  const auto [least, largest] = std::ranges::minmax(usual(&Piece::scatter));
  if (least < like_noise * largest || std::ranges::min(usual(&Piece::beside)) < clearly) return 0;
  const auto times = usual(&Piece::times);
  return std::min(std::sqrt(median({times.begin(), times.end()})), most);
}

}  // namespace emtb
