#include "analysis/record/settled_pieces.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "analysis/numerics/even_series.h"
#include "analysis/numerics/linear_algebra.h"
#include "analysis/numerics/scatter.h"
#include "analysis/numerics/statistics.h"

namespace emtb {

double settled_stretch(std::span<const double> t) {
  constexpr double a_second = 1, of_a_run = 0.1, readings = 50;
  return std::min(a_second, std::max(of_a_run * (t.back() - t.front()), readings * mean_interval(t)));
}

namespace {

/// With what rounding leaves out, so that readings that are all the same have some.
double deviation(const EvenLine& s, double lsb) { return std::sqrt(s.variance + lsb * lsb / 12); }

/// What bends a line most, taken off readings: the part that goes with the square of the time.
/// @param y the readings, then what is left of them @return by how much the middle lies off the ends
double without_bend(std::vector<double>& y) {
  const double middle = 0.5 * static_cast<double>(y.size() - 1), mean = middle * (middle + 1) / 3;
  double product = 0, squares = 0;
  for (std::size_t i = 0; i < y.size(); ++i) {
    const double bend = std::pow(static_cast<double>(i) - middle, 2) - mean;
    product += bend * y[i];
    squares += bend * bend;
  }
  const double by = product / squares;
  for (std::size_t i = 0; i < y.size(); ++i) y[i] -= by * (std::pow(static_cast<double>(i) - middle, 2) - mean);
  return std::abs(by) * middle * middle;
}

/// Still on its way, or there and back: what bends in the readings would count as noise.
bool moves(std::span<const double> y, double lsb) {
  constexpr double far = 4;  // standard deviations
  std::vector<double> straight(y.begin(), y.end());
  const double bends = y.size() > 3 ? without_bend(straight) : 0;
  const EvenLine s = even_line(straight);
  return std::max(s.rise, bends) > far * deviation(s, lsb);
}

/// The readings of a slow meter from where they no longer relax: the first ones are left out while they lie off the
/// line through the others. An exponential approach does so to its end, until steps of the meter hide it.
std::span<const double> settled_part(std::span<const double> y, double lsb) {
  constexpr double off = 2;  // standard errors of a prediction
  while (y.size() > fewest_readings) {
    const std::span<const double> others = y.subspan(1);
    const EvenLine s = even_line(others);
    const auto n = static_cast<double>(others.size());
    const double error = deviation(s, lsb) * std::sqrt(1 + 1 / n + 3 * (n + 1) / (n * (n - 1)));
    if (std::abs(y.front() - s.before) <= off * error) break;
    y = others;
  }
  return y;
}

constexpr double clear = 6;  // standard deviations of noise

/// What an input that does not change may still vary by: the noise with which it is read back, or a step of that.
double tolerance_of(const std::vector<double>& input) {
  constexpr double a_step = 0.02;  // of the input's range: what is smaller than that is a step of its reading
  double smallest = infinity;
  std::size_t same = 0;
  for (std::size_t k = 1; k < input.size(); ++k) {
    const double change = std::abs(input[k] - input[k - 1]);
    if (change == 0) ++same;
    if (change > 0) smallest = std::min(smallest, change);
  }
  if (2 * same < input.size()) return clear * difference_scatter(input);
  if (smallest == infinity) return 0;
  const auto [low, high] = std::ranges::minmax(input);
  return smallest < a_step * (high - low) ? 1.5 * smallest : 0.5 * smallest;
}

/// Takes out of a piece what follows the input at its rows and up to two rows before. A controller passes on the noise
/// of what it reads: that moves the motor, and is no noise of what is read then. What goes against the input does not
/// follow it: there the input is the controller's answer to the noise of that very reading, which stays.
void take_out_input(std::vector<double>& piece, const std::vector<std::size_t>& rows,
                    const std::vector<double>& input) {
  constexpr Eigen::Index straight = 2;
  constexpr std::size_t enough = 10;  // readings for each of what is fitted
  std::vector<std::size_t> lags{0, 1, 2};
  const auto n = static_cast<Eigen::Index>(piece.size());
  const bool varies = std::ranges::any_of(rows, [&](std::size_t row) { return input[row] != input[rows.front()]; });
  if (!varies || piece.size() < enough * (lags.size() + straight)) return;
  const Eigen::VectorXd y = Eigen::Map<const Eigen::VectorXd>(piece.data(), n);
  while (!lags.empty()) {
    const auto back = static_cast<Eigen::Index>(lags.size());
    Eigen::MatrixXd a(n, back + straight);
    for (Eigen::Index i = 0; i < n; ++i) {
      const std::size_t row = rows[static_cast<std::size_t>(i)];
      for (Eigen::Index k = 0; k < back; ++k) {
        a(i, k) = input[row - std::min(row, lags[static_cast<std::size_t>(k)])] - input[rows.front()];
      }
      a(i, back) = 1;
      a(i, back + 1) = static_cast<double>(i) / static_cast<double>(n);
    }
    const Eigen::VectorXd by = solve_normal(gram(a), transposed_product(a, y));
    Eigen::Index against = 0;
    if (by.head(back).minCoeff(&against) < 0) {
      lags.erase(lags.begin() + against);
      continue;
    }
    const Eigen::VectorXd left = y - a.leftCols(back) * by.head(back);
    std::ranges::copy(left, piece.begin());
    return;
  }
}

/// Half-open stretches of the grid over which the input does not change, for long enough.
std::vector<std::pair<std::size_t, std::size_t>> constant_stretches(const ObservedRun& record,
                                                                    const std::vector<double>& input) {
  const Excitation& x = record.excitation;
  std::vector<std::pair<std::size_t, std::size_t>> stretches;
  const bool quiet = x.u_ref.empty() && !record.voltage_noise.sigma.empty();  // more so amid a stretch than at its ends
  const double tolerance = quiet ? clear * record.voltage_noise.sigma.largest() : tolerance_of(input);
  const double shortest = settled_stretch(x.t);
  std::size_t begin = 0;
  for (std::size_t k = 1; k <= input.size(); ++k) {
    if (k < input.size() && std::abs(input[k] - input[begin]) <= tolerance) continue;
    if (x.t[k - 1] - x.t[begin] >= shortest) stretches.emplace_back(begin, k);
    begin = k;
  }
  return stretches;
}

}  // namespace

const std::vector<double>& input_of(const Excitation& x) {
  return !x.u_ref.empty() ? x.u_ref : !x.e_a.empty() ? x.e_a : x.i_a;
}

void collect(const ObservedRun& record, const Observation& o, SettledPieces& settled) {
  const Excitation& x = record.excitation;
  const std::vector<double>& input = input_of(x);
  const double shortest = settled_stretch(x.t);
  for (const auto& [begin, end] : constant_stretches(record, input)) {
    // The later half: the machine has had its time to settle. A slow meter is taken whole, a fast signal in pieces.
    const double from = 0.5 * (x.t[begin] + x.t[end - 1]), until = x.t[end - 1];
    TurningStretch piece;
    std::vector<double> time;
    std::vector<std::size_t> rows;
    double piece_begin = from;
    const auto take = [&] {
      if (o.slow && piece.value.size() >= 2) settled.short_slow.push_back(piece.value);
      if (piece.value.size() < fewest_readings) return;
      if (o.slow) {
        const std::span<const double> part = settled_part(piece.value, o.lsb);
        if (!moves(part, o.lsb)) settled.slow.emplace_back(part.begin(), part.end());
        return;
      }
      take_out_input(piece.value, rows, input);
      if (!moves(piece.value, o.lsb)) {
        settled.fast.push_back(piece);
        settled.time.push_back(time);
        settled.driven.push_back(input[rows.front()] != 0 ? 1 : 0);
      }
    };
    const auto ends = [&](std::uint32_t last) { return x.t[last]; };
    for (auto i = static_cast<std::size_t>(std::ranges::lower_bound(o.last, from, {}, ends) - o.last.begin());
         i < o.size() && x.t[o.last[i]] <= until; ++i) {
      const double t = x.t[o.last[i]];
      if (x.t[o.first[i]] < from) continue;
      if (!o.slow && t - piece_begin >= shortest) {
        take();
        piece = {};
        time.clear();
        rows.clear();
        piece_begin = t;
      }
      piece.value.push_back(o.value[i]);
      piece.angle.push_back(x.angle.empty() ? 0 : x.angle[o.last[i]]);
      time.push_back(t);
      rows.push_back(o.last[i]);
    }
    if (o.slow || until - piece_begin >= 0.9 * shortest) take();
  }
}

namespace {

/// Keeps some of the fast pieces.
void keep(SettledPieces& settled, const std::vector<std::size_t>& which) {
  SettledPieces kept;
  for (const std::size_t i : which) {
    kept.fast.push_back(std::move(settled.fast[i]));
    kept.time.push_back(std::move(settled.time[i]));
    kept.driven.push_back(settled.driven[i]);
  }
  settled.fast = std::move(kept.fast);
  settled.time = std::move(kept.time);
  settled.driven = std::move(kept.driven);
}

}  // namespace

void leave_out_rest(SettledPieces& settled, bool counts) {
  constexpr double slow = 0.02;  // of the fastest piece
  constexpr std::size_t enough = 4;
  const auto speed = [](const TurningStretch& piece) {
    double sum = 0;
    for (const double v : piece.value) sum += v;
    return std::abs(sum) / static_cast<double>(piece.value.size());
  };
  const auto constant = [](const TurningStretch& piece) {
    return std::ranges::all_of(piece.value, [&](double v) { return v == piece.value.front(); });
  };
  double fastest = 0;
  for (const TurningStretch& piece : settled.fast) fastest = std::max(fastest, speed(piece));
  std::vector<std::size_t> turning;
  for (std::size_t i = 0; i < settled.fast.size(); ++i) {
    if (counts ? speed(settled.fast[i]) < slow * fastest : constant(settled.fast[i])) continue;
    turning.push_back(i);
  }
  if (turning.size() >= enough) keep(settled, turning);
}

void leave_out_idle(SettledPieces& settled) {
  constexpr std::size_t enough = 2;
  constexpr double remembers = 0.5;  // from reading to reading: what has not settled, and a load that drifts
  std::vector<std::size_t> driven;
  std::vector<double> scatter, idle_scatter, correlation;
  for (std::size_t i = 0; i < settled.fast.size(); ++i) {
    const EvenLine line = even_line(settled.fast[i].value);
    (settled.driven[i] ? scatter : idle_scatter).push_back(line.variance);
    if (!settled.driven[i]) continue;
    correlation.push_back(line.variance > 0 ? line.covariance / line.variance : 1);
    driven.push_back(i);
  }
  if (driven.size() < enough || idle_scatter.empty()) return;
  if (median(correlation) > remembers) return;
  if (median(scatter) < clearly_louder * clearly_louder * median(idle_scatter)) return;
  keep(settled, driven);
}

void remove_what_repeats(SettledPieces& settled) {
  constexpr double slowest = 4, fastest = 30;  // [Hz]
  const auto enough = [](const TurningStretch& piece, std::size_t orders) { return piece.value.size() > 20 * orders; };
  const std::vector<Order> orders = strong_orders(settled.fast, 4);
  for (TurningStretch& piece : settled.fast) {
    if (enough(piece, orders.size())) remove_orders(piece, orders);
  }
  std::vector<TurningStretch> in_time;
  for (std::size_t i = 0; i < settled.fast.size(); ++i) {
    in_time.push_back({settled.time[i], settled.fast[i].value});
    for (double& t : in_time.back().angle) t *= 2 * std::numbers::pi;
  }
  const std::vector<Order> lines = strong_orders(in_time, 2, slowest, fastest);
  for (std::size_t i = 0; i < settled.fast.size(); ++i) {
    if (enough(in_time[i], lines.size())) remove_orders(in_time[i], lines);
    settled.fast[i].value = std::move(in_time[i].value);
  }
}

}  // namespace emtb
