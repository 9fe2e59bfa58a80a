#include "model/simulation.h"

#include "model/simulation_code.h"

namespace emtb {
namespace {

SimulationCode code_for(Processor processor) {
#ifdef EMTB_FOR_AVX2
  if (processor == Processor::avx2) return simulation_code_for<Processor::avx2>();
#endif
  static_cast<void>(processor);
  return simulation_code_for<Processor::any>();
}

}  // namespace

const SimulationCode& simulation_code() {
  static const SimulationCode code = code_for(processor());
  return code;
}

template <>
void simulate<double>(const ModelStructure& structure, std::span<const double> parameters, const Excitation& excitation,
                      Reader<double>& reader, const Variation& variation) {
  simulation_code().plain(structure, parameters, excitation, reader, variation);
}

template <>
void simulate<Sensitive>(const ModelStructure& structure, std::span<const Sensitive> parameters,
                         const Excitation& excitation, Reader<Sensitive>& reader, const Variation& variation) {
  simulation_code().sensitive(structure, parameters, excitation, reader, variation);
}

template <>
void simulate<WideSensitive>(const ModelStructure& structure, std::span<const WideSensitive> parameters,
                             const Excitation& excitation, Reader<WideSensitive>& reader, const Variation& variation) {
  simulation_code().wide(structure, parameters, excitation, reader, variation);
}

}  // namespace emtb
