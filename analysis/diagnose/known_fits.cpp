#include "analysis/diagnose/known_fits.h"

#include "analysis/fit/rotor_phase.h"
#include "hal/error.h"

namespace emtb {

KnownFits::Key KnownFits::key_of(const Model& model) { return {model.structure().effects, model.names()}; }

void KnownFits::remember(const Model& fitted) { values_.insert_or_assign(key_of(fitted), fitted.values()); }

std::optional<Model> KnownFits::that_leaves_less(std::span<const Record> records, const Fit& fit) const {
  constexpr double clearly = 1e-3;  // of the cost
  const auto known = values_.find(key_of(fit.model));
  if (known == values_.end()) return std::nullopt;
  Model other = fit.model;
  for (std::size_t i = 0; i < known->second.size(); ++i) {
    Parameter& p = other.at(i);
    if (p.fixed && !p.pinned && p.value != known->second[i]) return std::nullopt;
    p.value = known->second[i];
  }
  try {
    const double cost = 0.5 * squares_at_best_phases(records, other).squares;
    return cost < (1 - clearly) * fit.cost ? std::optional(std::move(other)) : std::nullopt;
  } catch (const ModelError&) {
    return std::nullopt;
  }
}

}  // namespace emtb
