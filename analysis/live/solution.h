#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "analysis/live/equations.h"
#include "analysis/live/knowledge.h"
#include "analysis/live/summed_pass.h"

namespace emtb {

/// What solving the sums of a pass says of the unknowns: the step from the point about which they are linear, and how
/// sure it is.
class LiveSolution {
 public:
  /// @param knowledge is kept
  explicit LiveSolution(const LiveKnowledge& knowledge);

  /// @param at the point about which the pass is linear. @return false: the sums are not finite, all stays as it was
  bool solve(const SummedPass& pass, std::span<const NoiseColour> colours, const Eigen::VectorXd& at);

  /// Standard errors that hold whatever the colour of the noise, and where one source of it is in several signals: by
  /// leaving out one second after another (the cluster-robust CR3 of Bell and McCaffrey 2002).
  void find_errors(const SummedPass& pass, std::span<const NoiseColour> colours);

  /// The pass is another one, and begins at its own solution.
  void restart() { step_.setZero(); }

  const Eigen::VectorXd& step() const { return step_; }
  const LiveEquations& equations() const { return equations_; }
  const Eigen::VectorXd& variance() const { return variance_; }      ///< of each unknown, as the residuals show
  const Eigen::MatrixXd& covariance() const { return covariance_; }  ///< as the weights claim
  double inflation() const { return inflation_; }                    ///< of the worst variance beyond that

  /// How far the step goes, in standard errors. @param parameters the first so many unknowns
  double distance(Eigen::Index parameters) const;

 private:
  const LiveKnowledge& knowledge_;
  Eigen::VectorXd step_;
  LiveEquations equations_;
  Eigen::MatrixXd covariance_;
  Eigen::VectorXd variance_;
  double inflation_ = 1;
};

}  // namespace emtb
