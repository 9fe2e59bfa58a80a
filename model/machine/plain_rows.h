#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "model/machine/armature.h"

namespace emtb {

/// What drives a machine whose steps are plain sums (Machine::is_plain()), row by row, as in Excitation.
struct PlainDrive {
  std::span<const double> t;               ///< [s]
  std::span<const double> u_ref;           ///< [V]
  std::span<const double> e_a;             ///< [V]
  std::span<const double> e_a_bulge = {};  ///< [V]

  double reference(std::size_t row) const { return u_ref.empty() ? 0 : u_ref[row]; }
  double terminals(std::size_t row) const { return e_a.empty() ? 0 : e_a[row]; }
  /// From the row to the next: a ramp of the same mean and the same end.
  Ramp<double> voltage(std::size_t row) const {
    return {e_a[row] + 2 * (e_a_bulge.empty() ? 0 : e_a_bulge[row]), e_a[row + 1]};
  }
};

/// The readings at the ends of some such steps, in their order.
template <class Scalar>
struct PlainRows {
  static constexpr std::size_t most = sizeof(Scalar) > sizeof(double) ? 16 : 64;  ///< a few KiB: in the nearest cache

  std::array<Scalar, most> e_a, i_a, omega, theta;
};

}  // namespace emtb
