#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "analysis/diagnose/null_fit.h"
#include "model/effect.h"

namespace emtb {

/// A candidate at certain values, and how it is looked at: as columns of sensitivities to what is not a shape, as two
/// waves a quarter of a period apart, or, if it fades, as the whole change that it makes.
struct Hypothesis {
  std::size_t effect = 0;
  const EffectInfo* info = nullptr;
  StartValues at{};
  bool whole = false;  ///< the change that it makes as it stands; it fades, or is sudden, or acts on edges

  const EffectInfo& about() const { return *info; }

  /// The parameters that have a null to be scored at.
  std::vector<std::size_t> amplitudes() const {
    std::vector<std::size_t> all;
    for (std::size_t i = 0; i < about().parameter_count; ++i) {
      if (!about().parameter_list[i].is_shape()) all.push_back(i);
    }
    return all;
  }
  std::size_t columns() const { return whole ? 1 : about().periodic ? 2 : amplitudes().size(); }
};

/// Where each candidate is looked at: at its null, or at the values from which a search starts; at the orders of the
/// shaft that stand out of what is left of the speed.
/// @param whole_orders what repeats with the angle: at all whole orders instead
std::vector<Hypothesis> hypotheses_of(const NullFit& fitted, std::span<const std::size_t> candidates,
                                      bool whole_orders);

}  // namespace emtb
