#pragma once

#include <array>
#include <cstddef>

#include "analysis/numerics/lag_sums.h"

namespace emtb {

/// The noise floor of a fast signal, as the mean of a block has it: from the residuals' differences over one and two
/// blocks, which no slow error of a model reaches: E(Δ₁²) = 2σ²(1 - ρ), E(Δ₂²) = 2σ²(1 - ρ²).
class DifferenceFloor {
 public:
  void add(double r);
  /// The next block does not follow the one before it.
  void interrupt() { seen_ = 0; }
  NoiseColour colour() const;  ///< rho: from block to block

 private:
  double first_ = 0, second_ = 0, firsts_ = 0, seconds_ = 0;
  double before_ = 0, before_that_ = 0;
  int seen_ = 0;
};

/// The noise floor of a slow meter, from the median change between its readings: most of them see a motor that is
/// settled.
class MeterFloor {
 public:
  void add(double value);
  double sigma() const;  ///< SI; 0 before the second reading

 private:
  std::array<double, 64> changes_{};  ///< the last ones, in any order
  std::size_t count_ = 0;
  double before_ = 0;
};

}  // namespace emtb
