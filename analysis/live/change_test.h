#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "analysis/live/change.h"
#include "analysis/live/half_seconds.h"
#include "analysis/live/unknowns.h"

namespace emtb {

/// Whether the last half-seconds are those of another motor, and which parameter would explain it.
struct ChangeScore {
  double score = 0;                     ///< of the best, standard errors
  double drop = 0;                      ///< of the squares, by the best
  std::vector<LiveSuspect> suspects;    ///< the best first: those that explain it about as well
  std::vector<std::size_t> parameters;  ///< of the suspects: places among the watched parameters
  std::size_t half_seconds = 0;         ///< the last so many are the changed ones
};

namespace change_at {
// Standard errors. By hand: with them two false alarms in 16 h (docs/decisions/live-estimates.md).
inline constexpr double alarm = 5;     ///< at which it is told
inline constexpr double doubtful = 4;  ///< above which nothing is learnt
}  // namespace change_at

inline constexpr double tied_within = 0.02;  ///< of what the best explains: those explain it as well; by hand
inline constexpr std::size_t most_tied = 3;  ///< suspects that are named; by hand

/// The test of a change at a time before now.
///
/// With u the unknowns, what came before gives u₀ and its covariance C; the last half-seconds give H u = g. Without a
/// change
///
///     y = g - H u₀  ~  N(0, H + H C H),
///
/// and a change of one unknown alone, δ eⱼ, adds H eⱼ δ to its mean. The generalised likelihood ratio over j (Willsky
/// and Jones 1976; Basseville and Nikiforov 1993, chapter 2) is the square of a score with one degree of freedom, in
/// standard errors. What alarms and what names are two questions: the score counts how well the motor was known, the
/// name goes to what takes most of the squares away, unless it makes another signal worse.
class ChangeTest {
 public:
  struct Data {
    const WatchedUnknowns& unknowns;
    const HalfSeconds& rows;
    std::span<const NoiseColour> colours;  ///< of the outputs
    LiveReach reach;
    Eigen::VectorXd inflation;  ///< of the standard errors of what came before, and of the scores
    bool loaded = false;        ///< the gauge has shown loads: then the load is known, whatever it is
  };

  explicit ChangeTest(Data data) : data_(std::move(data)) {}

  /// Have the last so many half-seconds changed?
  ChangeScore of(const Timeline& time, std::size_t last) const;

  /// Does the gauge show loads that are there or that come and go?
  /// @param at, covariance of the unknowns, as they were before
  bool shows_load(const Eigen::VectorXd& at, const Eigen::MatrixXd& covariance) const;

  /// A covariance with the standard errors inflated.
  Eigen::MatrixXd inflated(const Eigen::MatrixXd& covariance) const;

 private:
  struct Candidate {
    LiveSuspect suspect;
    std::size_t parameter = 0;
    double drop = 0;  ///< of the squares
    bool contradicted = false;
  };
  struct Whitened;

  void ignore_gauge(LiveEquations& recent) const;
  void let_drift(Eigen::MatrixXd& covariance) const;
  std::vector<LiveEquations> by_output(std::size_t last) const;
  std::vector<Candidate> candidates(const Whitened& white, const LiveEquations& recent, const Eigen::VectorXd& at,
                                    std::size_t last, double& highest_score) const;

  Data data_;
};

}  // namespace emtb
