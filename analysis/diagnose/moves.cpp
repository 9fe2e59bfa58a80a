#include "analysis/diagnose/moves.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "analysis/diagnose/refit.h"
#include "model/catalogue.h"
#include "model/lateness.h"

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

Model without(Model model, bool (*goes)(const EffectInfo&)) {
  for (const std::size_t effect : model.structure().effects) {
    if (goes(model.about(effect))) model.exclude(effect);
  }
  return model;
}

bool has_size(std::size_t effect, const Model& model) {
  const EffectInfo& about = model.about(effect);
  const std::vector<Parameter>& fitted = model.parameters_of(effect);
  bool any_size = false;
  for (std::size_t i = 0; i < about.parameter_count; ++i) {
    if (about.parameter_list[i].is_shape()) continue;
    if (fitted[i].value != about.parameter_list[i].null) return true;
    any_size = true;
  }
  return !any_size;  // it is there or not
}

std::optional<double> error_with(const Addition& a) {
  return has_size(a.effect(), a.trial.model()) ? std::optional(a.trial.held_out_error()) : std::nullopt;
}

bool needed(std::size_t effect, const Model& model) {
  return std::ranges::any_of(model.effects, [&](const IncludedEffect& e) {
    return effect_catalogue()[e.effect].needs == model.about(effect).id;
  });
}

std::optional<std::size_t> same_family_as(std::size_t effect, const std::vector<std::size_t>& found,
                                          const Trial& fitted) {
  const std::vector<Signal> compared = fitted.held_out.signals();
  const bool terminals_read = std::ranges::find(compared, Signal::e_a) != compared.end();
  const auto same = [&](const EffectInfo& a, const EffectInfo& b) {
    const bool of_one_edge = a.family == Family::driver_edges && b.holds_current();
    return a.same_family(b) || (of_one_edge && !terminals_read);
  };
  const EffectInfo& about = fitted.model().about(effect);
  for (const std::size_t other : found) {
    const EffectInfo& of_other = fitted.model().about(other);
    if (other != effect && (same(about, of_other) || same(of_other, about))) return other;
  }
  return std::nullopt;
}

bool says_how_late(std::size_t effect) {
  if (effect >= effect_count || effect_catalogue()[effect].periodic) return false;
  ModelStructure alone;
  alone.effects = {effect};
  const auto says = [&](Signal signal) { return says_how_late(alone, signal); };
  return shapes_edges(alone) || std::ranges::any_of(all_signals(), says);
}

bool does_better(const Criterion& criterion, const Loss& other, const Loss& current) {
  return likelier(other, current) && !criterion.tied(other, current) && !criterion.material(other, current);
}

bool does_as_well(const Criterion& criterion, const Trial& current, std::size_t member, const Trial& other,
                  std::size_t in_its_place) {
  constexpr double window = 3;  // [nats] Occam's, of Madigan and Raftery (1994)
  const Loss &own = current.held_out, &others = other.held_out;
  if (!criterion.tied(own, others)) return false;
  const auto free = [](const Trial& trial, std::size_t effect) {
    return std::ranges::count(trial.model().parameters_of(effect), false, &Parameter::fixed);
  };
  if (free(other, in_its_place) <= free(current, member) || !own.quality || !others.quality) return true;
  return gain(*others.quality, *own.quality) <= window;
}

std::vector<Model> with_fewer_amplitudes(const Model& fitted, std::size_t effect) {
  const std::span<const EffectParameter> about = fitted.about(effect).parameters();
  const auto is_amplitude = [](const EffectParameter& p) { return p.role == Role::amplitude && std::isfinite(p.null); };
  std::vector<Model> fewer;
  if (std::ranges::count_if(about, is_amplitude) < 2) return fewer;
  for (std::size_t i = 0; i < about.size(); ++i) {
    Model held = fitted;
    Parameter& p = held.parameters_of(effect)[i];
    if (!is_amplitude(about[i]) || p.fixed) continue;
    p.value = about[i].null;
    p.fixed = true;
    fewer.push_back(std::move(held));
  }
  return fewer;
}

std::vector<std::size_t> absent_waves(const Model& model) {
  std::vector<std::size_t> waves = absent_effects(model);
  std::erase_if(waves, [&](std::size_t effect) { return !model.about(effect).is_wave(); });
  return waves;
}

std::vector<Score> worth_a_refit(const std::vector<Score>& scores, const Model& fitted, std::size_t at_most,
                                 const ScoreOptions& options) {
  constexpr double least = 0.03;  // of what the best one promises; by hand
  std::vector<Score> by_drop = promising(scores, options);
  std::erase_if(by_drop, [&](const Score& s) { return !makes_sense(s.effect, fitted); });
  if (by_drop.empty()) return {};
  std::vector<Score> by_nats = by_drop;
  std::ranges::stable_sort(by_drop, std::greater{}, &Score::predicted_drop);
  std::ranges::stable_sort(by_nats, std::greater{}, &Score::predicted_nats);
  std::erase_if(by_drop,
                [&, most = by_drop.front().predicted_drop](const Score& s) { return s.predicted_drop < least * most; });
  std::erase_if(by_nats, [&, most = by_nats.front().predicted_nats](const Score& s) {
    return s.predicted_nats <= 0 || s.predicted_nats < least * most;
  });
  // The best by either in turn: a sum of squares is that of the signal furthest above its floor, and what the
  // likelihood gains near the floor may be a crumb.
  std::vector<Score> best;
  const auto take = [&](const std::vector<Score>& from, std::size_t i) {
    if (i >= from.size() || best.size() >= at_most) return;
    if (std::ranges::find(best, from[i].effect, &Score::effect) == best.end()) best.push_back(from[i]);
  };
  for (std::size_t i = 0; i < std::max(by_drop.size(), by_nats.size()); ++i) {
    take(by_drop, i);
    take(by_nats, i);
  }
  return best;
}

std::vector<Score> from_clear_sizes_too(const std::vector<Score>& scores, const Model& fitted,
                                        const FittedMachine& machine) {
  constexpr double clear = 10;     // times what would just be found; the way there is tried in parts
  constexpr double next = 30;      // times a size: a descent finds what is nearer
  constexpr std::size_t most = 3;  // sizes, the largest
  std::vector<Score> all = scores;
  std::erase_if(all, [&](const Score& s) {  // orders are searched for elsewhere
    return !makes_sense(s.effect, fitted) || fitted.about(s.effect).place_of(Role::order);
  });
  for (Score& s : all) {
    if (s.expected().empty()) continue;
    const EffectInfo& about = fitted.about(s.effect);
    const EffectParameter& first = about.parameter_list[0];
    if (about.at_null == AtNull::small && first.role == Role::limit) {  // no slope leads down from no limit
      for (const StartValues& at : starts_of(s.effect, machine.seen)) {
        const std::vector<double> there(at.begin(), at.begin() + static_cast<std::ptrdiff_t>(about.parameter_count));
        if (there != s.starts.front().from) s.starts.push_back({there, there, {}});
      }
      continue;
    }
    const bool has_sizes = !first.is_shape() && std::isfinite(first.null) && std::isfinite(first.max);
    if (!has_sizes || !(s.detectable_size < infinity) || s.detectable_size <= 0) continue;
    std::vector<Score::Start> sizes;
    const double expected = s.expected()[0] - first.null;
    for (double size = clear * s.detectable_size; first.null + size <= first.max; size *= next) {
      Score::Start there{s.starts.front().from, s.expected(), {}};
      there.expected[0] = first.null + size;
      const bool is_that_effect = s.effect >= effect_count || implausible(s.effect, there.expected, machine).empty();
      if (is_that_effect && size > std::abs(expected)) sizes.push_back(std::move(there));
    }
    const std::size_t some = std::min(most, sizes.size());
    s.starts.insert(s.starts.end(), sizes.end() - static_cast<std::ptrdiff_t>(some), sizes.end());
  }
  return all;
}

std::vector<Score> worth_pairing(const std::vector<Score>& scores, const Trial& fitted,
                                 const std::vector<std::size_t>& added, const ScoreOptions& options) {
  constexpr std::size_t tried = 4;  // the best scored: six pairs
  std::vector<Score> best = promising(scores, options);
  std::erase_if(best, [&](const Score& s) {
    return !makes_sense(s.effect, fitted.model()) || same_family_as(s.effect, added, fitted);
  });
  if (best.size() > tried) best.resize(tried);
  return best;
}

std::vector<const Addition*> near_the_best(const std::vector<Addition>& refits, double cost,
                                           std::optional<std::size_t> begun_with) {
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
