#pragma once

#include <cstddef>
#include <span>

#include "model/simulation.h"
#include "model/step.h"

namespace emtb {

/// The processors that the simulation is compiled for. The program as a whole runs on any of its architecture; what is
/// here compiled for one of them is called where the machine has it.
enum class Processor {
  any,  ///< of the architecture: SSE2 on x86-64, NEON on arm64
  avx2  ///< x86-64 with AVX2 and FMA: Intel since 2013, AMD since 2015
};

/// The best that this machine has; or what the environment variable EMTB_SIMD names: `baseline` or `avx2`.
/// @throws ModelError where EMTB_SIMD names something else, or what this machine has not
Processor processor();

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
