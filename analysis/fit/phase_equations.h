#pragma once

#include <span>
#include <vector>

#include "analysis/fit/phase_knots.h"
#include "analysis/fit/residuals.h"

namespace emtb {

/// The equations of the phase at the knots: a little more at one of them moves what is read around it as the same phase
/// throughout would, for the machine soon forgets where its rotor stood. Tridiagonal.
class PhaseEquations {
 public:
  PhaseEquations(const Knots& knots, std::span<const double> at)
      : diagonal_(at.size(), 0.0), beside_(at.size(), 0.0), gradient_(at.size(), 0.0) {
    for (std::size_t k = 0; k + 1 < at.size(); ++k) {
      const double stiffness = knots.stiffness(), change = at[k + 1] - at[k];
      diagonal_[k] += stiffness;
      diagonal_[k + 1] += stiffness;
      beside_[k] -= stiffness;
      gradient_[k] += stiffness * change;
      gradient_[k + 1] -= stiffness * change;
    }
  }

  /// @param r its last column the sensitivity to the phase
  void add(const Residuals& r, std::span<const Knots::Place> places) {
    const auto phase = r.sensitivity.rightCols<1>();
    const bool many = diagonal_.size() > 1;
    for (std::size_t i = 0; i < places.size(); ++i) {
      const auto [knot, share] = places[i];
      const double s = phase.data()[i], here = (1 - share) * s, next = share * s, left = r.value.data()[i];
      diagonal_[knot] += here * here;
      gradient_[knot] += here * left;
      information_ += s * s;
      if (!many) continue;
      diagonal_[knot + 1] += next * next;
      beside_[knot] += here * next;
      gradient_[knot + 1] += next * left;
    }
  }

  bool informed() const { return information_ > 0; }
  /// What a step takes off the sum of squares.
  double gain(std::span<const double> step) const {
    double gain = 0;
    for (std::size_t k = 0; k < step.size(); ++k) {
      gain += step[k] * (2 * gradient_[k] - diagonal_[k] * step[k]);
      if (k > 0) gain -= 2 * beside_[k - 1] * step[k - 1] * step[k];
    }
    return gain;
  }
  std::vector<double> step() const { return solved(gradient_); }

  /// The changes of the knots that bring forth a right-hand side (elimination after Thomas).
  std::vector<double> solved(std::vector<double> x) const {
    std::vector<double> pivot(diagonal_);
    for (std::size_t k = 1; k < pivot.size(); ++k) {
      const double factor = beside_[k - 1] / pivot[k - 1];
      pivot[k] -= factor * beside_[k - 1];
      x[k] -= factor * x[k - 1];
    }
    for (std::size_t k = pivot.size(); k-- > 0;) {
      if (k + 1 < pivot.size()) x[k] -= beside_[k] * x[k + 1];
      x[k] /= pivot[k];
    }
    return x;
  }

 private:
  std::vector<double> diagonal_, beside_, gradient_;
  double information_ = 0;
};

/// Of residuals whose last column is the sensitivity to the phase.
PhaseEquations equations_of(std::span<const Residuals> seen, const Knots& knots, std::span<const double> at);

}  // namespace emtb
