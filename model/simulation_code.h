#pragma once

#include <cstddef>
#include <span>

#include "hal/processor.h"
#include "model/simulation.h"
#include "model/step.h"

namespace emtb {

/// The innermost loops of the program: what costs nearly all of the time of a fit. All arguments are in memory, so that
/// the callers need not agree on registers.
///
/// docs/decisions/simd.md says how they are compiled, and why their code cannot stray into the rest of the program.
struct SimulationCode {
  template <class Scalar>
  using Simulate = void (*)(const ModelStructure&, std::span<const Scalar>, const Excitation&, Reader<Scalar>&,
                            const Variation&);

  Simulate<double> plain;
  Simulate<Sensitive> sensitive;
  Simulate<WideSensitive> wide;
  void (*step)(Machine<WideSensitive>& machine, const StepInput& in, double t, double h);  ///< Machine::step()
  std::size_t machine_size;  ///< of a Machine<WideSensitive>: the same in all, for it is handed over
};
static_assert(sizeof(Sensitive) == 64 && alignof(Sensitive) == 32);
static_assert(sizeof(WideSensitive) == 96 && alignof(WideSensitive) == 32);

/// As compiled for one processor; call it where the machine has that processor alone.
template <Processor>
SimulationCode simulation_code_for();
template <>
SimulationCode simulation_code_for<Processor::any>();
template <>
SimulationCode simulation_code_for<Processor::avx2>();

/// As compiled for the processor() of this machine.
const SimulationCode& simulation_code();

}  // namespace emtb
