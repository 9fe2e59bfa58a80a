#include "analysis/live/knowledge.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "analysis/numerics/linear_algebra.h"

namespace emtb {
namespace {

/// An even distribution over a range says 12/range².
double information_of(double range) { return 12 / (range * range); }

}  // namespace

LiveKnowledge::LiveKnowledge(const Model& model, const FreeParameters& free, const LivePlan& plan)
    : low_(static_cast<Eigen::Index>(plan.unknowns())),
      high_(static_cast<Eigen::Index>(plan.unknowns())),
      known_(LiveEquations::zero(static_cast<Eigen::Index>(plan.unknowns()))),
      absorbed_(known_) {
  for (const auto& output : plan.outputs) {
    if (!output.slow) continue;
    // A current that stands still is read with the same rounding all the time.
    const auto i = static_cast<Eigen::Index>(output.offset);
    const double digit = std::max(output.lsb, 1e-9);
    high_[i] = digit;
    low_[i] = -digit;
    known_.h(i, i) = information_of(digit);
  }
  for (std::size_t j = 0; j < free.size(); ++j) {
    const auto i = static_cast<Eigen::Index>(j);
    const Parameter& p = model.at(free.places()[j]);
    low_[i] = p.min;
    high_[i] = p.max;
    known_.h(i, i) = p.prior ? 1 / (p.prior->std * p.prior->std) : information_of(p.max - p.min);
    known_.g[i] = known_.h(i, i) * (p.prior ? p.prior->value : p.value);
  }
}

/// What is left of a step's information where so much is added. @return by which it is to be multiplied from the left
Eigen::MatrixXd LiveKnowledge::kept_share(const Eigen::MatrixXd& added) const {
  const Eigen::MatrixXd& h = known_.h;
  const Eigen::VectorXd size = h.diagonal().cwiseSqrt();
  const Eigen::MatrixXd scaled = size.cwiseInverse().asDiagonal() * h * size.cwiseInverse().asDiagonal();
  const Eigen::MatrixXd root = size.asDiagonal() * cholesky(scaled);
  Eigen::MatrixXd inverse(h.rows(), h.cols());  // of the root
  const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(h.rows(), h.cols());
  for (Eigen::Index j = 0; j < h.cols(); ++j) inverse.col(j) = solve_lower(root, one.col(j));
  const Eigensystem eigen = eigensystem(inverse * added * inverse.transpose());
  Eigen::VectorXd left(eigen.values.size());
  for (Eigen::Index i = 0; i < left.size(); ++i) {
    left[i] = std::sqrt(1 - 0.5 * std::clamp(2 * eigen.values[i], 0.0, 1.0));
  }
  return root * eigen.vectors * left.asDiagonal() * eigen.vectors.transpose() * inverse;
}

void LiveKnowledge::absorb(const LiveEquations& told, const Eigen::VectorXd& at) {
  if (!told.finite()) return;
  const Eigen::VectorXd old_at = solve_normal(absorbed_.h, absorbed_.g);
  const Eigen::MatrixXd keep = kept_share(told.h);
  const Eigen::MatrixXd old = keep * absorbed_.h * keep.transpose();
  known_.h += old + told.h - absorbed_.h;
  known_.g += old * old_at + told.h * at + told.g - absorbed_.g;
  absorbed_.g += old * old_at + told.h * at + told.g - absorbed_.g;
  absorbed_.h = old + told.h;
}

}  // namespace emtb
