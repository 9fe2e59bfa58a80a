#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "model/dual.h"
#include "model/structure.h"

namespace emtb {

/// What drives a simulated run: values at the times t, each signal empty where the structure does not need it.
struct Excitation {
  std::vector<double> t;            ///< [s], increasing; the simulation's readings are at these times
  std::vector<double> u_ref;        ///< [V] held from its time to the next
  std::vector<double> e_a;          ///< [V] linear in between
  std::vector<double> i_a;          ///< [A] of a current drive, held
  std::vector<double> load;         ///< [N m] linear in between
  std::vector<double> omega;        ///< [rad/s] measured speed, for load effects beside a measured torque
  std::vector<char> armature_open;  ///< from its time to the next
  InitialState initial;
  double longest_step = 1e-3;  ///< [s] longer intervals are divided
};

/// How many derivatives one pass carries: one vector register of AVX2 (docs/decisions/sensitivities.md).
inline constexpr std::size_t derivatives_per_pass = 4;
using Sensitive = Dual<derivatives_per_pass>;

/// The readings that the model predicts at each time of the excitation.
template <class Scalar>
struct Trajectory {
  std::vector<Scalar> e_a, i_a, omega, theta, torque;

  void resize(std::size_t n) {
    for (auto* signal : {&e_a, &i_a, &omega, &theta, &torque}) signal->resize(n);
  }
};

/// Simulates a run.
/// @param parameters R_a, K_b, K_m, B, J, then those of each effect, in the order of the structure
/// @param out resized and filled; reuse it to spare allocations
template <class Scalar>
void simulate(const ModelStructure& structure, std::span<const Scalar> parameters, const Excitation& excitation,
              Trajectory<Scalar>& out);

extern template void simulate<double>(const ModelStructure&, std::span<const double>, const Excitation&,
                                      Trajectory<double>&);
extern template void simulate<Sensitive>(const ModelStructure&, std::span<const Sensitive>, const Excitation&,
                                         Trajectory<Sensitive>&);

}  // namespace emtb
