#include "model/simulation.h"

#include <algorithm>
#include <cmath>
#include <limits>

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

double longest_step_of(const ModelStructure& structure, const Excitation& excitation) {
  const bool quick = std::ranges::any_of(structure.effects, [](std::size_t e) { return effect_catalogue()[e].quick; });
  return quick ? std::min(excitation.quick_step, excitation.longest_step) : excitation.longest_step;
}

bool keeps_no_past(const ModelStructure& structure, const Excitation& x) {
  const auto keeps_none = [](std::size_t effect) {
    const EffectInfo& about = effect_catalogue()[effect];
    return about.memory == 0 && !about.periodic && !about.in_time;
  };
  return structure.terms.empty() && (x.e_a.empty() || x.e_a_held) && x.omega.empty() && x.load.empty() &&
         std::ranges::all_of(structure.effects, keeps_none);
}

std::size_t steps_of(const ModelStructure& structure, const Excitation& excitation) {
  constexpr double until_it_stands = 400;  // steps of a tenth of a time constant, 30 of them down to the last digit
  const std::size_t rows = excitation.t.size();
  if (rows < 2) return rows;
  const double interval = (excitation.t.back() - excitation.t.front()) / static_cast<double>(rows - 1);
  const double most = keeps_no_past(structure, excitation) ? until_it_stands : std::numeric_limits<double>::infinity();
  const double steps = std::round(interval / longest_step_of(structure, excitation));
  return rows * static_cast<std::size_t>(std::clamp(steps, 1.0, most));
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
