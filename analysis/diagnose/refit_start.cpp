#include "analysis/diagnose/refit_start.h"

#include <algorithm>
#include <cmath>

#include "model/effect.h"

namespace emtb {

std::optional<RefitStart> with_effect(std::span<const PreparedRun> records, const Model& fitted, double squares,
                                      std::size_t effect, const Score::Start& start,
                                      std::span<const RotorPhase> phases) {
  const FreeParameters free(fitted);
  const EffectInfo& about = fitted.about(effect);
  const auto at = [&](double share) {
    Model extended = fitted;
    for (std::size_t i = 0; i < start.others.size(); ++i) {
      Parameter& p = extended.at(free.places()[i]);
      p.value = std::clamp(p.value + std::min(share, 1.0) * start.others[i], p.min, p.max);
    }
    extended.include(effect);
    std::vector<Parameter>& added = extended.parameters_of(effect);
    for (std::size_t i = 0; i < added.size(); ++i) {
      Parameter& p = added[i];
      if (p.fixed) continue;
      const double part = about.parameter_list[i].is_shape() ? std::min(share, 1.0) : share;
      p.value = std::clamp(start.from[i] + part * (start.expected[i] - start.from[i]), p.min, p.max);
    }
    return extended;
  };
  RefitStart best;
  best.phases.assign(phases.begin(), phases.end());
  // The phases are searched for the whole way, and followed from there.
  const auto look_at = [&](double share) {
    RefitStart there{at(share), 0, {}};
    ResidualsAtPhases seen = residuals_at_best_phases(records, there.model, there.model.values(), {}, best.phases);
    there.squares = sum_of_squares(seen.residuals);
    there.phases = std::move(seen.phases);
    return there;
  };
  best = look_at(1);
  // The score is linear; what it expects of an effect that another imitates can be far off.
  for (const double share : {0.5, 0.2, 0.05}) {
    if (best.squares < squares) break;
    if (RefitStart nearer = look_at(share); !(nearer.squares >= best.squares)) best = std::move(nearer);
  }
  // It sees only as much of a wave as keeps step with the measured angle, which wanders.
  for (double share = 2; about.periodic && best.squares < squares && share <= 16; share *= 2) {
    RefitStart larger = look_at(share);
    if (!(larger.squares < best.squares)) break;
    best = std::move(larger);
  }
  if (!std::isfinite(best.squares)) return std::nullopt;
  return best;
}

}  // namespace emtb
