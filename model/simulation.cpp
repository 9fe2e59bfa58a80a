#include "model/simulation.h"

#include <cstdlib>
#include <string>
#include <string_view>

#include "hal/error.h"
#include "model/simulation_code.h"

namespace emtb {
namespace {

bool has_avx2() {
#ifdef EMTB_FOR_AVX2
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
#else
  return false;
#endif
}

SimulationCode code_for(Processor processor) {
#ifdef EMTB_FOR_AVX2
  if (processor == Processor::avx2) return simulation_code_for<Processor::avx2>();
#endif
  static_cast<void>(processor);
  return simulation_code_for<Processor::any>();
}

}  // namespace

Processor processor() {
  const char* wish = std::getenv("EMTB_SIMD");
  const std::string_view named = wish == nullptr ? "" : wish;
  if (named == "baseline") return Processor::any;
  if (named.empty()) return has_avx2() ? Processor::avx2 : Processor::any;
  if (named != "avx2") {
    throw ModelError("EMTB_SIMD is `" + std::string(named) + "`. Write `baseline` or `avx2`, or leave it out.");
  }
  if (!has_avx2()) {
    throw ModelError(
        "EMTB_SIMD is `avx2`, which this machine or this build has not. Write `baseline`, or leave it out.");
  }
  return Processor::avx2;
}

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
