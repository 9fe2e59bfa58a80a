#pragma once

#include <Eigen/Core>

#include "analysis/numerics/linear_algebra.h"

namespace emtb {

/// What the fitted parameters (s) say of the residuals (r), summed over records.
struct OwnSums {
  Eigen::MatrixXd ss;
  Eigen::VectorXd sr;
  double readings = 0;

  explicit OwnSums(Eigen::Index p = 0) : ss(Eigen::MatrixXd::Zero(p, p)), sr(Eigen::VectorXd::Zero(p)) {}

  void add(const MatrixPart& s, const MatrixPart& r);
};

/// What a candidate (c) has to do with them.
struct CrossSums {
  Eigen::MatrixXd sc, cc;
  Eigen::VectorXd cr;

  explicit CrossSums(Eigen::Index p = 0, Eigen::Index q = 0)
      : sc(Eigen::MatrixXd::Zero(p, q)), cc(Eigen::MatrixXd::Zero(q, q)), cr(Eigen::VectorXd::Zero(q)) {}

  void add(const MatrixPart& s, const MatrixPart& c, const MatrixPart& r);
  /// The same where the products with the candidate are known.
  /// @param products Sᵀ C, and below it rᵀ C
  void add(const MatrixPart& c, const MatrixPart& products);
  CrossSums& operator+=(const CrossSums& b) {
    sc += b.sc;
    cc += b.cc;
    cr += b.cr;
    return *this;
  }
};

/// What the fitted parameters would do to imitate the candidate: (SᵀS)⁻¹ SᵀC, scaled against their different sizes.
Eigen::MatrixXd imitation(const OwnSums& own, const CrossSums& cross);

/// What only the candidate can do: its columns less what the fitted parameters imitate of them, C'.
struct Projected {
  Eigen::MatrixXd information;  ///< C'ᵀC'
  Eigen::VectorXd gradient;     ///< C'ᵀr
};
Projected project(const OwnSums& own, const CrossSums& cross, const Eigen::MatrixXd& imitation);

}  // namespace emtb
