#include "analysis/diagnose/moves.h"

#include <algorithm>

#include "analysis/diagnose/refit.h"
#include "model/catalogue.h"

namespace emtb {

std::vector<std::size_t> absent_effects(const Model& model) {
  std::vector<std::size_t> absent;
  for (std::size_t e = 0; e < model.known_effects(); ++e) {
    if (!model.includes(e) && !model.withholds(e)) absent.push_back(e);
  }
  return absent;
}

bool makes_sense(std::size_t effect, const Model& model) {
  const std::string_view needs = model.about(effect).needs;
  return needs.empty() || model.includes(effect_index(needs));
}

bool needed(std::size_t effect, const Model& model) {
  return std::ranges::any_of(model.effects, [&](const IncludedEffect& e) {
    return effect_catalogue()[e.effect].needs == model.about(effect).id;
  });
}

std::optional<std::size_t> same_family_as(std::size_t effect, const std::vector<std::size_t>& found,
                                          const Model& model) {
  const EffectInfo& about = model.about(effect);
  for (const std::size_t other : found) {
    if (other != effect && about.same_family(model.about(other))) return other;
  }
  return std::nullopt;
}

std::vector<std::size_t> absent_detents(const Model& model) {
  std::vector<std::size_t> detents;
  for (std::size_t effect = 0; effect < effect_count; ++effect) {
    if (effect_catalogue()[effect].is_detent() && !model.includes(effect) && !model.withholds(effect)) {
      detents.push_back(effect);
    }
  }
  return detents;
}

std::vector<Score> worth_a_refit(const std::vector<Score>& scores, const Model& fitted, std::size_t at_most,
                                 const ScoreOptions& options) {
  constexpr double least = 0.03;  // of the best one's drop; by hand
  std::vector<Score> best = promising(scores, options);
  std::erase_if(best, [&](const Score& s) { return !makes_sense(s.effect, fitted); });
  if (best.size() > at_most) best.resize(at_most);
  std::erase_if(best, [&](const Score& s) { return s.predicted_drop < least * best.front().predicted_drop; });
  return best;
}

std::vector<Score> worth_pairing(const std::vector<Score>& scores, const Model& fitted,
                                 const std::vector<std::size_t>& added, const ScoreOptions& options) {
  constexpr std::size_t tried = 4;  // the best scored: six pairs
  std::vector<Score> best = promising(scores, options);
  std::erase_if(
      best, [&](const Score& s) { return !makes_sense(s.effect, fitted) || same_family_as(s.effect, added, fitted); });
  if (best.size() > tried) best.resize(tried);
  return best;
}

std::vector<const Addition*> near_the_best(const std::vector<Addition>& refits, double cost, std::size_t begun_with) {
  constexpr std::size_t followed = 3;
  constexpr double near = 0.5;  // of what the best first step removed of the cost; by hand
  std::vector<const Addition*> begun;
  for (const Addition& refit : refits) begun.push_back(&refit);
  if (begun.empty()) return begun;
  std::ranges::stable_sort(begun, {}, [](const Addition* a) { return a->trial.fit.cost; });
  const double most = cost - begun.front()->trial.fit.cost;
  std::erase_if(begun,
                [&](const Addition* a) { return a->effect() == begun_with || cost - a->trial.fit.cost < near * most; });
  if (begun.size() > followed) begun.resize(followed);
  return begun;
}

const Trial* known_for(std::size_t effect, const Trial& fit) {
  return keeps_phases(effect, fit.model()) ? &fit : nullptr;
}

}  // namespace emtb
