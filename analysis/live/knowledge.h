#pragma once

#include <Eigen/Core>

#include "analysis/live/equations.h"
#include "analysis/live/plan.h"
#include "model/model.h"

namespace emtb {

/// What is known of the unknowns beside what the history tells: their bounds, the model file's priors, and what the
/// part of the history told that is forgotten.
class LiveKnowledge {
 public:
  LiveKnowledge(const Model& model, const FreeParameters& free, const LivePlan& plan);

  const Eigen::VectorXd& low() const { return low_; }
  const Eigen::VectorXd& high() const { return high_; }
  const Eigen::MatrixXd& information() const { return known_.h; }

  /// As equations for a step from a point.
  LiveEquations about(const Eigen::VectorXd& at) const { return {known_.h, known_.g - known_.h * at}; }

  /// A sum of squares with what it adds at a point, but for a constant.
  double cost(double squares, const Eigen::VectorXd& at) const {
    return squares + at.dot(known_.h * at) - 2 * at.dot(known_.g);
  }

  /// Takes in what a forgotten part of the history told. In the directions in which what was taken in before is one: as
  /// much as is new of each takes its place, half at most.
  /// @param told about the point `at`
  void absorb(const LiveEquations& told, const Eigen::VectorXd& at);

 private:
  Eigen::MatrixXd kept_share(const Eigen::MatrixXd& added) const;

  Eigen::VectorXd low_, high_;
  LiveEquations known_;     ///< about zero
  LiveEquations absorbed_;  ///< the part of it that priors and bounds are not
};

}  // namespace emtb
