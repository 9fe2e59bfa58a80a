#pragma once

#include <Eigen/Core>

namespace emtb {

/// The noise of a signal's blocks: their scatter, and how much of it each has of the one before it.
struct Colour {
  double sigma = 1;  ///< SI
  double rho = 0;    ///< first-order autocorrelation
};

/// Residuals r and sensitivities s of the blocks of one signal, as sums of fixed size. With the products of neighbours
/// among them the least squares can be whitened afterwards, (r_k - ρ r_{k-1}) and (s_k - ρ s_{k-1}), for any ρ:
///
///     Σ (s_k - ρ s_{k-1})(s_k - ρ s_{k-1})ᵀ = (1 + ρ²) Σ s sᵀ - ρ Σ (s_k s_{k-1}ᵀ + s_{k-1} s_kᵀ)
class LagSums {
 public:
  explicit LagSums(Eigen::Index parameters);

  void clear();
  void add(const LagSums& other);
  /// Counts for less. @param share 0 to 1
  void fade(double share);
  /// Residuals as they would be about another point: r - sᵀ d.
  void move_point(const Eigen::VectorXd& d);

  /// A block.
  void add(const Eigen::VectorXd& s, double r);
  /// Two blocks that follow each other without a hole.
  void add_pair(const Eigen::VectorXd& s_before, double r_before, const Eigen::VectorXd& s, double r);

  double blocks() const { return blocks_; }

  /// Adds this signal's part of the normal equations, H step = g.
  void weigh_into(Eigen::MatrixXd& h, Eigen::VectorXd& g, const Colour& colour) const;

  /// The weighed sum of squares after a step of the parameters.
  double cost(const Eigen::VectorXd& step, const Colour& colour) const;

 private:
  double squares(const Eigen::VectorXd& step) const;
  double products(const Eigen::VectorXd& step) const;

  Eigen::MatrixXd ss_, ss_next_;  ///< Σ s sᵀ, and its neighbours' mean with its transpose
  Eigen::VectorXd sr_, sr_next_;
  double rr_ = 0, rr_next_ = 0, blocks_ = 0, pairs_ = 0;
};

/// A⁻¹ of a symmetric, positive A whose rows may be of very different sizes.
Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& a);

/// The step that minimizes ½ stepᵀ H step - gᵀ step within low <= step <= high.
Eigen::VectorXd bounded_step(const Eigen::MatrixXd& h, const Eigen::VectorXd& g, const Eigen::VectorXd& low,
                             const Eigen::VectorXd& high);

}  // namespace emtb
