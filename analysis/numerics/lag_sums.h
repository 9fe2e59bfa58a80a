#pragma once

#include <Eigen/Core>

namespace emtb {

/// The noise of a signal's blocks: their scatter, and how much of it each has of the one before it.
struct NoiseColour {
  double sigma = 1;  ///< SI
  double rho = 0;    ///< first-order autocorrelation
};

/// Residuals r and sensitivities s of the blocks of one signal, as sums of fixed size. With the products of neighbours
/// among them the least squares can be whitened afterwards, (r_k - ρ r_{k-1}) and (s_k - ρ s_{k-1}), for any ρ:
///
///     Σ (s_k - ρ s_{k-1})(s_k - ρ s_{k-1})ᵀ = Σ s_k s_kᵀ + ρ² Σ s_{k-1} s_{k-1}ᵀ - ρ Σ (s_k s_{k-1}ᵀ + s_{k-1} s_kᵀ)
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

  /// Takes the sensitivities for their mean throughout. While a motor runs evenly, what they vary by is noise of the
  /// measured input, which is in the residuals as well: their product would not average away.
  void level();

  double blocks() const { return blocks_; }
  /// Of the i-th sensitivity.
  double mean_square(Eigen::Index i) const { return blocks_ > 0 ? of_all_.ss(i, i) / blocks_ : 0; }

  /// Adds this signal's part of the normal equations, H step = g.
  void weigh_into(Eigen::MatrixXd& h, Eigen::VectorXd& g, const NoiseColour& colour) const;

  /// The weighed sum of squares after a step of the parameters.
  double cost(const Eigen::VectorXd& step, const NoiseColour& colour) const;

 private:
  /// Products of the blocks with themselves, or with their neighbours.
  struct Products {
    Eigen::MatrixXd ss;
    Eigen::VectorXd sr;
    double rr = 0;

    explicit Products(Eigen::Index parameters) : ss(parameters, parameters), sr(parameters) {}
    void clear();
    void add(const Products& other);
    void add(const Eigen::VectorXd& s, double r);
    void fade(double share);
    void move_point(const Eigen::VectorXd& d);
    double after(const Eigen::VectorXd& step) const;  ///< rr about another point
  };

  Products of_all_;    ///< the blocks
  Products of_first_;  ///< of each pair
  Products of_pairs_;  ///< the mean of both orders
  Eigen::VectorXd s_;  ///< Σ s
  double r_ = 0, blocks_ = 0, pairs_ = 0;
};

}  // namespace emtb
