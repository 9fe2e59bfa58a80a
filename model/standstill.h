#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "model/dual.h"

namespace emtb {

/// Whether a number that goes from step to step has come to a stand, with all its derivatives: each changes by no more
/// than a rounding of the largest that it has been.
template <class Scalar>
class Standstill;

template <>
class Standstill<double> {
 public:
  /// @return whether it stood in this step
  bool see(double before, double now) {
    constexpr double rounding = 1e-11;
    most_ = std::max({most_, std::abs(before), std::abs(now)});
    return std::abs(now - before) <= rounding * most_;
  }

 private:
  double most_ = 0;
};

template <std::size_t N>
class Standstill<Dual<N>> {
 public:
  bool see(const Dual<N>& before, const Dual<N>& now) {
    bool stood = value_.see(before.v, now.v);
    for (std::size_t i = 0; i < N; ++i) stood = derivative_[i].see(before.d[i], now.d[i]) && stood;
    return stood;
  }

 private:
  Standstill<double> value_;
  std::array<Standstill<double>, N> derivative_{};
};

/// What moves of a machine.
template <class Scalar>
struct Stand {
  Standstill<Scalar> omega, i_a, driver;
};

}  // namespace emtb
