#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "analysis/live/equations.h"
#include "analysis/numerics/lag_sums.h"

namespace emtb {

/// The rows of half a second or a little more, in which nothing is told apart.
struct HalfSecond {
  std::vector<LagSums> sums;  ///< of each output
  double begin = 0;           ///< [s]
  std::size_t run = 0;        ///< that it is of
  double weight = 0, omega = 0,
         i_a = 0;  ///< sums by the squares that are left: those, and with them where the motor was

  double blocks() const;
};

/// What is known from before the half-seconds, and what each of them adds.
struct Timeline {
  LiveEquations known;
  std::vector<LiveEquations> half_seconds;  ///< oldest first

  LiveEquations before(std::size_t last) const;  ///< all but the last so many
  LiveEquations recent(std::size_t last) const;  ///< these
};

/// Rows by half-seconds: the last ones each, what is older as sums that fade.
class HalfSeconds {
 public:
  HalfSeconds(std::size_t outputs, Eigen::Index unknowns, std::size_t most);

  void clear();

  /// That rows go into now.
  HalfSecond& open() { return ring_[closed_]; }
  void close() { ++closed_; }

  std::size_t closed() const { return closed_; }
  const HalfSecond& oldest() const { return ring_.front(); }
  /// The last so many that are closed.
  std::span<const HalfSecond> last(std::size_t count) const { return std::span(ring_).subspan(closed_ - count, count); }
  /// Of each output, all that is older.
  const std::vector<LagSums>& older() const { return older_; }

  /// The oldest half-second becomes part of what is older, which fades. @param kept share of that
  void retire_oldest(double kept);

  /// Residuals as they would be about another point.
  void move_point(const Eigen::VectorXd& d);

 private:
  std::vector<LagSums> older_;
  std::vector<HalfSecond> ring_;  ///< oldest first; those behind the open one are empty
  std::size_t closed_ = 0;
};

/// By how much the scores of the half-seconds scattered more than their information says: noise with a colour, and
/// what the model never explained.
class ScoreScatter {
 public:
  explicit ScoreScatter(Eigen::Index unknowns)
      : squares_(Eigen::VectorXd::Zero(unknowns)), information_(Eigen::VectorXd::Zero(unknowns)) {}

  /// @param at the unknowns as they were expected. @param kept share of what came before
  void add(const LiveEquations& half_second, const Eigen::VectorXd& at, double kept);

  /// Of a standard error, by unknown: 1 and more.
  Eigen::VectorXd inflation() const;

 private:
  Eigen::VectorXd squares_, information_;
};

}  // namespace emtb
