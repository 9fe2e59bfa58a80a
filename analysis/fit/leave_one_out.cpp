#include "analysis/fit/leave_one_out.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "analysis/fit/at_bound.h"
#include "analysis/fit/normal_equations.h"

namespace emtb {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// The free parameters around the optimum of all records, each in units of its own curvature: what rests on a bound, or
/// is told by none, does not move.
class Surroundings {
 public:
  Surroundings(const FitProblem& problem, const Model& fitted, std::vector<double> x,
               std::span<const NormalEquations> each)
      : problem_(problem), fitted_(fitted), x_(std::move(x)) {
    const NormalEquations all = problem.sum_of(each, x_);
    unit_ = all.sts.diagonal().cwiseSqrt().cwiseInverse();
    for (Eigen::Index i = 0; i < unit_.size(); ++i) {
      if (!std::isfinite(unit_[i]) || rests_on_bound(parameter(i), all.str[i], unit_[i])) unit_[i] = 0;
    }
    MatrixXd a = unit_.asDiagonal() * all.sts * unit_.asDiagonal();
    for (Eigen::Index i = 0; i < unit_.size(); ++i) a(i, i) = unit_[i] > 0 ? a(i, i) + regular : 1;
    of_all_.compute(a);
  }

  /// The model at which a record is judged by the others.
  Model judging(const NormalEquations& record) const {
    std::vector<double> there = x_;
    const VectorXd shift = shift_of(record);
    for (Eigen::Index i = 0; i < shift.size(); ++i) {
      double& value = there[static_cast<std::size_t>(i)];
      value = std::clamp(value - shift[i], parameter(i).min, parameter(i).max);
    }
    return with_values(fitted_, problem_.free(), there);
  }

 private:
  static constexpr double regular = 1e-10;  // of the curvature: what nothing tells stays solvable

  const Parameter& parameter(Eigen::Index i) const {
    return fitted_.at(problem_.free().places()[static_cast<std::size_t>(i)]);
  }

  /// Of S_k A^-1 S_k', which has the eigenvalues `share` of L^-1 H_k L^-T: what (I - it)^(-1/2) adds to r_k.
  VectorXd shift_of(const NormalEquations& record) const {
    constexpr double alone = 1 - 1e-6;  // what the record tells by itself
    constexpr double nothing = 1e-6;    // of a share: the limit is a half
    const MatrixXd h = unit_.asDiagonal() * record.sts * unit_.asDiagonal();
    const MatrixXd half = of_all_.matrixL().solve(h);
    const Eigen::SelfAdjointEigenSolver<MatrixXd> parts(MatrixXd(of_all_.matrixL().solve(half.transpose())));
    VectorXd along = parts.eigenvectors().transpose() * of_all_.matrixL().solve(unit_.cwiseProduct(record.str));
    for (Eigen::Index i = 0; i < along.size(); ++i) {
      const double share = std::min(parts.eigenvalues()[i], alone);
      along[i] *= share > nothing ? (1 / std::sqrt(1 - share) - 1) / share : 0.5;
    }
    return unit_.cwiseProduct(of_all_.matrixU().solve(parts.eigenvectors() * along));
  }

  const FitProblem& problem_;
  const Model& fitted_;
  std::vector<double> x_;
  VectorXd unit_;
  Eigen::LLT<MatrixXd> of_all_;
};

}  // namespace

std::vector<Model> judged_in_turn(std::span<const Record> records, const Fit& of_all, CalibrationOptions options) {
  options.phases = of_all.phases;
  const FitProblem problem(records, of_all.model, options);
  std::vector<double> x = problem.free().pick({});
  if (x.empty()) return std::vector<Model>(records.size(), of_all.model);
  const std::vector<NormalEquations> each = problem.of_each(x, true);
  const Surroundings around(problem, of_all.model, std::move(x), each);
  std::vector<Model> models;
  for (const NormalEquations& record : each) {
    const bool tells = record.sts.allFinite() && record.str.allFinite();
    models.push_back(tells ? around.judging(record) : of_all.model);
  }
  return models;
}

}  // namespace emtb
