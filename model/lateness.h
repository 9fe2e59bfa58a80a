#pragma once

#include <algorithm>

#include "hal/signal.h"
#include "model/catalogue.h"
#include "model/structure.h"

namespace emtb {

/// Do the equations themselves say how late a signal is read: by an effect of its instrument, or for the current by
/// what holds it back? Then nothing else does: how the runs were logged is a part of it.
inline bool says_how_late(const ModelStructure& structure, Signal signal) {
  return std::ranges::any_of(structure.effects, [signal](std::size_t effect) {
    const EffectInfo& about = effect_catalogue()[effect];
    if (signal == Signal::i_a && about.holds_current()) return true;
    const bool of_any_speed = about.reads == Signal::omega && !about.bench.tachogenerator;
    const bool its_own = about.reads == signal || (signal == Signal::theta && of_any_speed);
    return its_own && (about.parameter_list[0].unit == "s" || about.periodic);  // a wave has a phase of its own
  });
}

/// Do they say how late the driver's edges come?
inline bool shapes_edges(const ModelStructure& structure) {
  return std::ranges::any_of(
      structure.effects, [](std::size_t effect) { return effect_catalogue()[effect].family == Family::driver_edges; });
}

}  // namespace emtb
