#include "analysis/discover/shares.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>

#include "analysis/discover/samples.h"
#include "analysis/numerics/linear_algebra.h"

namespace emtb {
namespace {

constexpr std::size_t knots_of_one = 12, knots_of_two = 6;
constexpr int orders = 12;

/// The columns of one quantity's curve, and how strongly each difference of neighbours is held.
struct Basis {
  Eigen::MatrixXd columns;
  Eigen::MatrixXd penalty;
};

Basis angle_basis(const std::vector<double>& theta) {
  const auto n = static_cast<Eigen::Index>(theta.size());
  Basis basis{Eigen::MatrixXd(n, 2 * orders), Eigen::MatrixXd::Zero(2 * orders, 2 * orders)};
  for (int order = 1; order <= orders; ++order) {
    for (Eigen::Index i = 0; i < n; ++i) {
      basis.columns(i, 2 * order - 2) = std::cos(order * theta[static_cast<std::size_t>(i)]);
      basis.columns(i, 2 * order - 1) = std::sin(order * theta[static_cast<std::size_t>(i)]);
    }
    basis.penalty(2 * order - 2, 2 * order - 2) = basis.penalty(2 * order - 1, 2 * order - 1) = 1;
  }
  return basis;
}

/// The same waves, always against the motion: friction that is not alike all around the turn.
Basis angle_friction_basis(const std::vector<double>& theta, const std::vector<double>& omega) {
  Basis basis = angle_basis(theta);
  for (Eigen::Index i = 0; i < basis.columns.rows(); ++i) {
    if (omega[static_cast<std::size_t>(i)] < 0) basis.columns.row(i) *= -1;
  }
  return basis;
}

/// Hats over knots at even quantiles and second differences.
Basis curve_basis(const std::vector<double>& x, std::size_t knot_count = knots_of_one) {
  std::vector<double> sorted = x, knots;
  std::ranges::sort(sorted);
  for (std::size_t k = 0; k < knot_count; ++k) {
    const double at = sorted[k * (sorted.size() - 1) / (knot_count - 1)];
    const double apart = 0.01 * (sorted.back() - sorted.front());
    if (knots.empty() || at > knots.back() + apart) knots.push_back(at);
  }
  const auto n = static_cast<Eigen::Index>(x.size()), m = static_cast<Eigen::Index>(knots.size());
  Basis basis{Eigen::MatrixXd::Zero(n, m), 1e-3 * Eigen::MatrixXd::Identity(m, m)};
  for (Eigen::Index i = 0; i < n; ++i) {
    const double at = std::clamp(x[static_cast<std::size_t>(i)], knots.front(), knots.back());
    const auto above = std::ranges::lower_bound(knots, at) - knots.begin();
    const double share =
        above == 0 ? 0
                   : (at - knots[static_cast<std::size_t>(above - 1)]) /
                         (knots[static_cast<std::size_t>(above)] - knots[static_cast<std::size_t>(above - 1)]);
    if (above == 0) {
      basis.columns(i, 0) = 1;
    } else {
      basis.columns(i, above) = share;
      basis.columns(i, above - 1) = 1 - share;
    }
  }
  for (Eigen::Index k = 2; k < m; ++k) {
    Eigen::VectorXd bend = Eigen::VectorXd::Zero(m);
    bend[k - 2] = bend[k] = 1;
    bend[k - 1] = -2;
    basis.penalty += bend * bend.transpose();
  }
  return basis;
}

Basis direction_basis(const std::vector<double>& omega) {
  const auto n = static_cast<Eigen::Index>(omega.size());
  Basis basis{Eigen::MatrixXd(n, 2), 1e-3 * Eigen::MatrixXd::Identity(2, 2)};
  for (Eigen::Index i = 0; i < n; ++i) {
    basis.columns(i, 0) = omega[static_cast<std::size_t>(i)] > 0 ? 1 : 0;
    basis.columns(i, 1) = 1 - basis.columns(i, 0);
  }
  return basis;
}

/// Products of the columns of two curves, each differences held along both.
Basis product_basis(const Basis& a, const Basis& b) {
  const Eigen::Index m = a.columns.cols(), k = b.columns.cols();
  Basis basis{Eigen::MatrixXd(a.columns.rows(), m * k), Eigen::MatrixXd::Zero(m * k, m * k)};
  for (Eigen::Index i = 0; i < m; ++i) {
    for (Eigen::Index j = 0; j < k; ++j) {
      basis.columns.col(i * k + j) = a.columns.col(i).cwiseProduct(b.columns.col(j));
      for (Eigen::Index l = 0; l < m; ++l) basis.penalty(i * k + j, l * k + j) += a.penalty(i, l);
      for (Eigen::Index l = 0; l < k; ++l) basis.penalty(i * k + j, i * k + l) += b.penalty(j, l);
    }
  }
  return basis;
}

/// What several curves explain together of each group left out, in squares.
struct Judged {
  double share = 0, std_error = 0;
};

class Judge {
 public:
  explicit Judge(const Samples& s) : samples_(s) {
    const auto n = static_cast<Eigen::Index>(s.size());
    lines_.resize(n, 3);
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto k = static_cast<std::size_t>(i);
      lines_.row(i) << s.omega[k], s.i_a[k], s.acceleration[k];
    }
    const Eigen::VectorXd size = (lines_.colwise().squaredNorm() / static_cast<double>(n)).cwiseSqrt();
    for (Eigen::Index c = 0; c < 3; ++c) lines_.col(c) /= size[c] > 0 ? size[c] : 1;
    without_ = squares_left({}, 0);
  }

  Judged of(std::span<const Basis* const> bases) const {
    Judged best{-1e300, 0};
    for (const double strength : {1e-3, 1e-2, 1e-1, 1.0}) {
      const std::vector<double> with = squares_left(bases, strength);
      double sum = 0, all = 0, scatter = 0;
      for (std::size_t g = 0; g < with.size(); ++g) {
        sum += with[g];
        all += without_[g];
      }
      const double share = all > 0 ? 1 - sum / all : 0;
      if (share <= best.share) continue;
      for (std::size_t g = 0; g < with.size(); ++g) {
        const double off = without_[g] - with[g] - share * without_[g];
        scatter += off * off;
      }
      best = {share, all > 0 ? std::sqrt(scatter) / all : 0};
    }
    return best;
  }

 private:
  std::vector<double> squares_left(std::span<const Basis* const> bases, double strength) const {
    Eigen::Index width = lines_.cols();
    for (const Basis* b : bases) width += b->columns.cols();
    const auto n = lines_.rows();
    Eigen::MatrixXd x(n, width), penalty = 1e-6 * Eigen::MatrixXd::Identity(width, width);
    x.leftCols(3) = lines_;
    Eigen::Index at = 3;
    for (const Basis* b : bases) {
      x.middleCols(at, b->columns.cols()) = b->columns;
      penalty.block(at, at, b->columns.cols(), b->columns.cols()) += strength * b->penalty;
      at += b->columns.cols();
    }
    const Eigen::Map<const Eigen::VectorXd> y(samples_.value.data(), n);
    const std::size_t groups = samples_.groups;
    std::vector<Eigen::MatrixXd> squares(groups, Eigen::MatrixXd::Zero(width, width));
    std::vector<Eigen::VectorXd> along(groups, Eigen::VectorXd::Zero(width));
    std::vector<std::pair<Eigen::Index, Eigen::Index>> rows(groups, {n, 0});
    for (Eigen::Index i = 0; i < n; ++i) {
      auto& [begin, end] = rows[samples_.group[static_cast<std::size_t>(i)]];
      begin = std::min(begin, i);
      end = std::max(end, i + 1);
    }
    Eigen::MatrixXd all = Eigen::MatrixXd::Zero(width, width);
    Eigen::VectorXd all_along = Eigen::VectorXd::Zero(width);
    for (std::size_t g = 0; g < groups; ++g) {
      if (rows[g].second <= rows[g].first) continue;
      const Eigen::MatrixXd part = x.middleRows(rows[g].first, rows[g].second - rows[g].first);
      squares[g] = gram(part);
      along[g] = transposed_product(part, y.segment(rows[g].first, part.rows()));
      all += squares[g];
      all_along += along[g];
    }
    std::vector<double> left(groups, 0.0);
    for (std::size_t g = 0; g < groups; ++g) {
      if (rows[g].second <= rows[g].first) continue;
      const double count = static_cast<double>(n);
      const Eigen::VectorXd value = solve_normal((all - squares[g]) / count + penalty, (all_along - along[g]) / count);
      const Eigen::Index length = rows[g].second - rows[g].first;
      left[g] = (y.segment(rows[g].first, length) - product(x.middleRows(rows[g].first, length), value)).squaredNorm();
    }
    return left;
  }

  const Samples& samples_;
  Eigen::MatrixXd lines_;
  std::vector<double> without_;
};

/// What speed and another quantity explain together that a curve of each does not.
void add_pairs(Shares& shares, const Samples& s, const Judge& judge, const std::map<std::string, Basis>& bases) {
  constexpr double notable = 0.05, errors = 2;
  const std::string first = "omega";
  const Basis of_speed = curve_basis(states_over(s, first), knots_of_two);
  for (const char* second : {"i_a", "acceleration", "t", "u_ref"}) {
    const Basis both = product_basis(of_speed, curve_basis(states_over(s, second), knots_of_two));
    const std::array<const Basis*, 1> one{&both};
    const std::array<const Basis*, 2> two{&bases.at(first), &bases.at(second)};
    const Judged alone = judge.of(one);
    const double apart = std::max({judge.of(two).share, shares.of[first].alone, shares.of[second].alone}),
                 more = alone.share - apart;
    if (more < std::max(notable, errors * alone.std_error)) continue;
    shares.of[first + " and " + second] = {alone.share, more, alone.std_error};
    shares.ceiling = std::max(shares.ceiling, alone.share);
  }
}

}  // namespace

Shares shares_of(const WhatIsLeft& left, bool voltage) {
  constexpr std::size_t fewest = 60;
  Shares shares;
  const Samples s = samples_of(left, voltage);
  if (s.size() < fewest) return shares;
  double squares = 0;
  for (const double v : s.value) squares += v * v;
  shares.rms = std::sqrt(squares / static_cast<double>(s.size()));
  std::map<std::string, Basis> bases;
  bases["omega"] = curve_basis(s.omega);
  bases["i_a"] = curve_basis(s.i_a);
  bases["acceleration"] = curve_basis(s.acceleration);
  bases["t"] = curve_basis(s.t);
  bases["u_ref"] = curve_basis(s.u_ref);
  bases["theta"] = angle_basis(s.theta);
  if (turns_both_ways(s)) bases["theta_against_motion"] = angle_friction_basis(s.theta, s.omega);
  bases["direction"] = direction_basis(s.omega);
  const Judge judge(s);
  std::vector<const Basis*> all;
  for (const auto& [name, basis] : bases) all.push_back(&basis);
  shares.together = judge.of(all).share;
  shares.ceiling = std::max(0.0, shares.together);
  for (const auto& [name, basis] : bases) {
    const std::array<const Basis*, 1> one{&basis};
    const Judged alone = judge.of(one);
    std::vector<const Basis*> others;
    for (const Basis* b : all) {
      if (b != &basis) others.push_back(b);
    }
    shares.of[name] = {alone.share, shares.together - judge.of(others).share, alone.std_error};
    shares.ceiling = std::max(shares.ceiling, alone.share);
  }
  add_pairs(shares, s, judge, bases);
  return shares;
}

}  // namespace emtb
