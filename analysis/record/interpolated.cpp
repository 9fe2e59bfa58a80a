#include "analysis/record/interpolated.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

namespace emtb {
namespace {

/// How far a row is off the straight line from one row to another.
double off_chord(const Series& series, std::size_t from, std::size_t k, std::size_t to) {
  const double share = (series.t[k] - series.t[from]) / (series.t[to] - series.t[from]);
  return series.value[k] - series.value[from] - share * (series.value[to] - series.value[from]);
}

/// By how much each row is off the line through its neighbours; the first and the last by nothing.
std::vector<double> bends_of(const Series& series) {
  constexpr std::size_t enough = 20000;  // rows: what more would say takes time
  std::vector<double> bends(std::min(enough, series.value.size()), 0.0);
  for (std::size_t k = 1; k + 1 < bends.size(); ++k) bends[k] = std::abs(off_chord(series, k - 1, k, k + 1));
  return bends;
}

/// The row, of the first `rows`, from which on every so many-th bends most; none where these have no more of all bends
/// than others, as noise has it.
std::optional<std::size_t> most_bent(const std::vector<double>& bends, std::size_t rows) {
  constexpr double much = 0.3;  // of all: what last digits leave to it
  std::vector<double> sums(rows, 0.0);
  std::size_t place = 0;
  for (const double bend : bends) {
    sums[place] += bend;
    if (++place == rows) place = 0;
  }
  const auto most = std::ranges::max_element(sums);
  if (*most < much * std::accumulate(sums.begin(), sums.end(), 0.0)) return std::nullopt;
  return static_cast<std::size_t>(most - sums.begin());
}

/// A signal in stretches of so many rows, from a first one on.
class Stretches {
 public:
  Stretches(const Series& series, std::size_t end, std::size_t rows, std::size_t first)
      : series_(series), rows_(rows), first_(first), count_(end > first ? (end - first - 1) / rows : 0) {}

  /// Is it straight in each, to its last digits, before and after it bends clearly from one to the next?
  bool are_straight() const {
    constexpr double clearly = 10;  // times the last digits
    constexpr double nearly_all = 0.97, last_digit_of_double = 1e-12;
    constexpr std::size_t enough = 20;
    if (count_ < enough) return false;
    std::vector<double> within;
    double largest = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      largest = std::max(largest, std::abs(value(i)));
      for (std::size_t k = row(i) + 1; k < row(i + 1); ++k)
        within.push_back(std::abs(off_chord(row(i), k, row(i + 1))));
    }
    const auto most = within.begin() + static_cast<std::ptrdiff_t>(nearly_all * static_cast<double>(within.size()));
    std::ranges::nth_element(within, most);
    const double exact = last_digit_of_double * largest, last_digits = *most + exact, clear = clearly * last_digits;
    std::size_t bends = 0, straight = 0;
    for (std::size_t i = 1; i < count_; ++i) {
      if (std::abs(bend(i)) <= clear) continue;
      ++bends;
      if (off_chord_at_most(i - 1) <= 2 * last_digits && off_chord_at_most(i) <= 2 * last_digits) ++straight;
    }
    return bends >= enough && static_cast<double>(straight) >= nearly_all * static_cast<double>(bends) &&
           !are_curved(last_digits);
  }

 private:
  std::size_t row(std::size_t i) const { return first_ + i * rows_; }
  double value(std::size_t i) const { return series_.value[row(i)]; }

  double off_chord(std::size_t from, std::size_t k, std::size_t to) const {
    return emtb::off_chord(series_, from, k, to);
  }

  /// Over the i-th stretch.
  double off_chord_at_most(std::size_t i) const {
    double most = 0;
    for (std::size_t k = row(i) + 1; k < row(i + 1); ++k)
      most = std::max(most, std::abs(off_chord(row(i), k, row(i + 1))));
    return most;
  }

  /// Where the i-th stretch begins, off the chord over it and the one before.
  double bend(std::size_t i) const { return off_chord(row(i - 1), row(i), row(i + 1)); }

  /// Does what is off the chords lie on one side of each, as in a curve, and not on both, as last digits do?
  /// @param last_digits what is off by more, in a few rows, tells no more
  bool are_curved(double last_digits) const {
    constexpr double one_sided = 0.9;  // of last digits, which those of the ends shift together, it is 0.7 to 0.8
    double sided = 0, all = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      double sum = 0;
      for (std::size_t k = row(i) + 1; k < row(i + 1); ++k) {
        const double off = std::clamp(off_chord(row(i), k, row(i + 1)), -last_digits, last_digits);
        sum += off;
        all += std::abs(off);
      }
      sided += std::abs(sum);
    }
    return sided > one_sided * all;
  }

  const Series& series_;
  std::size_t rows_, first_, count_;
};

}  // namespace

StraightRows straight_rows(const Series& series) {
  constexpr std::size_t fewest_rows = 3, most_rows = 100;  // of two, half of all rows bend
  const std::vector<double> bends = bends_of(series);
  for (std::size_t rows = std::min(most_rows, bends.size() / 10); rows >= fewest_rows; --rows) {
    const std::optional<std::size_t> first = most_bent(bends, rows);
    if (first && Stretches(series, bends.size(), rows, *first).are_straight()) return {rows, *first};
  }
  return {};
}

Series without_straight_rows(const Series& series) {
  const auto [rows, first] = straight_rows(series);
  if (rows == 1) return series;
  std::vector<double> t, value;
  for (std::size_t k = first; k < series.value.size(); k += rows) {
    t.push_back(series.t[k]);
    value.push_back(series.value[k]);
  }
  Series readings = series;
  readings.t = std::move(t);
  readings.value = std::move(value);
  return readings;
}

}  // namespace emtb
