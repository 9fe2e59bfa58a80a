// Compiled once for each processor (emtb_for_processors() in cmake/EmtbBuild.cmake), which EMTB_PROCESSOR names.
#include "model/simulation_code.h"

#include "model/simulation_loop.h"

#ifndef EMTB_PROCESSOR
#define EMTB_PROCESSOR any
#endif

namespace emtb {

template <>
SimulationCode simulation_code_for<Processor::EMTB_PROCESSOR>() {
  return {
      .plain = simulate_here<double, Reader<double>>,
      .sensitive = simulate_here<Sensitive, Reader<Sensitive>>,
      .wide = simulate_here<WideSensitive, Reader<WideSensitive>>,
      .step = [](Machine<WideSensitive>& machine, const StepInput& in, double t, double h) { machine.step(in, t, h); },
      .machine_size = sizeof(Machine<WideSensitive>)};
}

}  // namespace emtb
