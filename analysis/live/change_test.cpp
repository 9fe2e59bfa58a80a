#include "analysis/live/change_test.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include "analysis/numerics/linear_algebra.h"

namespace emtb {
namespace {

constexpr double most_varied = 3;       ///< times the noise of a gauge, beyond which loads come and go; by hand
constexpr double least_noise = 0.05;    ///< of a score's variance, also where the inflations cancel; by hand
constexpr double informed_from = 1e-9;  ///< of the largest eigenvalue: below it a direction is rounding

/// Does a change of one unknown that explains one signal make another worse than chance could?
bool contradicts(const std::vector<LiveEquations>& signals, Eigen::Index j, double change, const Eigen::VectorXd& at) {
  return std::ranges::any_of(signals, [&](const LiveEquations& e) {
    const double pull = e.g[j] - e.h.row(j).dot(at);
    return 2 * change * pull - change * change * e.h(j, j) < -change_at::alarm * change_at::alarm;
  });
}

}  // namespace

/// y with a covariance of one, and what a change of each unknown does to it.
struct ChangeTest::Whitened {
  Eigen::VectorXd size;   ///< units in which each unknown is known to about one
  Eigen::MatrixXd l;      ///< H = L Lᵀ; L⁺ y has a covariance of about one, and no part that H does not inform
  Eigen::MatrixXd lower;  ///< of the covariance of L⁺ y
  Eigen::VectorXd y;

  /// @return absent where the last half-seconds inform nothing
  static std::optional<Whitened> make(const Eigen::VectorXd& size, const LiveEquations& recent,
                                      const Eigen::VectorXd& at, const Eigen::MatrixXd& covariance,
                                      const Eigen::VectorXd& inflation) {
    const Eigen::Index n = size.size();
    const Eigen::MatrixXd scaled = size.cwiseInverse().asDiagonal() * covariance * size.cwiseInverse().asDiagonal();
    const Eigensystem eigen = eigensystem(size.asDiagonal() * recent.h * size.asDiagonal());
    Eigen::Index first = 0;
    while (first < n && eigen.values[first] < informed_from * eigen.values[n - 1]) ++first;
    const Eigen::Index rank = n - first;
    if (rank == 0 || !(eigen.values[n - 1] > 0)) return {};
    const Eigen::VectorXd root = eigen.values.tail(rank).cwiseSqrt();
    const Eigen::MatrixXd vectors = eigen.vectors.rightCols(rank);
    const Eigen::MatrixXd l = vectors * root.asDiagonal();
    const Eigen::VectorXd y =
        root.cwiseInverse().asDiagonal() * (vectors.transpose() * (size.asDiagonal() * (recent.g - recent.h * at)));
    const Eigen::MatrixXd bent =
        root.cwiseInverse().asDiagonal() * product(vectors.transpose() * inflation.asDiagonal(), l);
    Eigen::MatrixXd s = product(bent, bent.transpose()) + product(l.transpose(), scaled * l);
    s.diagonal().array() += least_noise;
    const Eigen::MatrixXd lower = cholesky(s);
    return Whitened{.size = size, .l = l, .lower = lower, .y = solve_lower(lower, y)};
  }
};

Eigen::MatrixXd ChangeTest::inflated(const Eigen::MatrixXd& covariance) const {
  return data_.inflation.asDiagonal() * covariance * data_.inflation.asDiagonal();
}

bool ChangeTest::shows_load(const Eigen::VectorXd& at, const Eigen::MatrixXd& covariance) const {
  const Eigen::Index j = as_index(*data_.unknowns.gauge());
  return data_.inflation[j] > most_varied ||
         std::abs(at[j]) > change_at::alarm * std::sqrt(covariance(j, j)) + data_.unknowns.gauge_digit();
}

void ChangeTest::ignore_gauge(LiveEquations& recent) const {
  const Eigen::Index j = as_index(*data_.unknowns.gauge());
  recent.h.row(j).setZero();
  recent.h.col(j).setZero();
  recent.g[j] = 0;
}

/// Unknowns move by themselves.
void ChangeTest::let_drift(Eigen::MatrixXd& covariance) const {
  for (Eigen::Index i = 0; i < covariance.rows(); ++i) {
    const double digit = data_.unknowns.digit(i);
    if (digit > 0) {
      covariance(i, i) += digit * digit / 6;
    } else {
      const double drift = data_.unknowns.allowed_drift(static_cast<std::size_t>(i), data_.reach);
      covariance(i, i) += drift * drift;
    }
  }
}

/// What each signal alone says in the last so many half-seconds.
std::vector<LiveEquations> ChangeTest::by_output(std::size_t last) const {
  std::vector<LiveEquations> signals(data_.rows.older().size(), LiveEquations::zero(data_.unknowns.size()));
  for (const HalfSecond& half : data_.rows.last(last)) {
    for (std::size_t o = 0; o < signals.size(); ++o) {
      if (half.sums[o].blocks() > 0) half.sums[o].weigh_into(signals[o].h, signals[o].g, data_.colours[o]);
    }
  }
  return signals;
}

/// Those whose change could be what is seen. @param highest_score of all, those that are too unlikely included
std::vector<ChangeTest::Candidate> ChangeTest::candidates(const Whitened& white, const LiveEquations& recent,
                                                          const Eigen::VectorXd& at, std::size_t last,
                                                          double& highest_score) const {
  std::vector<Candidate> all;
  std::vector<LiveEquations> signals;  // needed only where something is suspected
  for (std::size_t j = 0; j < data_.unknowns.parameters().size(); ++j) {
    const WatchedParameter& p = data_.unknowns.parameters()[j];
    const Eigen::Index i = as_index(j);
    if (!p.may_change) continue;
    const Eigen::VectorXd a = solve_lower(white.lower, white.l.row(i).transpose());
    const double information = a.squaredNorm();
    if (!(information > 1e-12)) continue;
    const double unit = white.size[i];
    const double change = a.dot(white.y) / information * unit;
    const double value = data_.unknowns.value(j) + at[i] + change;
    if (!std::isfinite(change) || value < p.low || value > p.high) continue;
    const double score = std::abs(a.dot(white.y)) / std::sqrt(information);
    highest_score = std::max(highest_score, score);
    if (score < change_at::doubtful) continue;
    // What it takes of the squares that are there, whatever uncertainty may excuse.
    const double pull = recent.g[i] - recent.h.row(i).dot(at);
    if (signals.empty()) signals = by_output(last);
    all.push_back({.suspect = {p.name, p.unit, change, unit / std::sqrt(information), score},
                   .parameter = j,
                   .drop = pull * pull / recent.h(i, i),
                   .contradicted = contradicts(signals, i, pull / recent.h(i, i), at)});
  }
  return all;
}

ChangeScore ChangeTest::of(const Timeline& time, std::size_t last) const {
  const LiveEquations earlier = time.before(last);
  LiveEquations recent = time.recent(last);
  const Eigen::VectorXd size = (earlier.h + recent.h).diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd claimed = scaled_inverse(earlier.h);
  const Eigen::VectorXd at = claimed * earlier.g;
  Eigen::MatrixXd covariance = inflated(claimed);
  if (data_.unknowns.gauge() && (data_.loaded || shows_load(at, covariance))) ignore_gauge(recent);
  let_drift(covariance);
  ChangeScore found{.suspects = {}, .parameters = {}, .half_seconds = last};
  const std::optional<Whitened> white = Whitened::make(size, recent, at, covariance, data_.inflation);
  if (!white) return found;
  std::vector<Candidate> all = candidates(*white, recent, at, last, found.score);
  if (!std::ranges::all_of(all, &Candidate::contradicted)) std::erase_if(all, std::mem_fn(&Candidate::contradicted));
  if (all.empty()) return found;
  std::ranges::sort(all, std::greater{}, &Candidate::drop);
  found.drop = all.front().drop;
  // Of those that explain it alike, first what the data say most surely.
  const auto explains_less = [&](const Candidate& c) { return c.drop < (1 - tied_within) * found.drop; };
  const auto tied = std::ranges::find_if(all, explains_less);
  std::ranges::sort(all.begin(), tied, std::greater{}, [](const Candidate& c) { return c.suspect.score; });
  for (const Candidate& c : all) {
    if (found.suspects.size() == most_tied || explains_less(c)) break;
    found.suspects.push_back(c.suspect);
    found.parameters.push_back(c.parameter);
  }
  return found;
}

}  // namespace emtb
