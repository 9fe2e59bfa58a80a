#include "analysis/diagnose/load_law.h"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

namespace emtb {
namespace {

/// Withholds those effects of which `left_alone` holds, beside those that were withheld.
template <class LeftAlone>
void withhold(Model& model, LeftAlone left_alone) {
  for (std::size_t effect = 0; effect < model.known_effects(); ++effect) {
    if (!model.withholds(effect) && left_alone(model.about(effect))) model.withheld.push_back(effect);
  }
}

/// The model with what another has free: of the effects that both include, and of the base.
Model with_freedom_of(Model model, const Model& other) {
  const auto copy = [](std::vector<Parameter>& own, const std::vector<Parameter>& others) {
    for (std::size_t i = 0; i < own.size(); ++i) {
      own[i].fixed = others[i].fixed;
      own[i].pinned = others[i].pinned;
    }
  };
  copy(model.base, other.base);
  for (const IncludedEffect& e : other.effects) {
    if (model.includes(e.effect)) copy(model.parameters_of(e.effect), e.parameters);
  }
  model.withheld = other.withheld;
  return model;
}

/// A model with the effects of a law, as free as it was itself; what was found beside the law is left out.
Model on_top_of(const Model& first, Model with_law, const std::vector<std::size_t>& effects) {
  const std::vector<IncludedEffect> included = with_law.effects;
  for (const IncludedEffect& e : included) {
    if (!first.includes(e.effect) && std::ranges::find(effects, e.effect) == effects.end()) with_law.exclude(e.effect);
  }
  return with_freedom_of(std::move(with_law), first);
}

/// A law, or the same with a rival in the place of a member.
struct Variant {
  std::vector<std::size_t> effects;
  std::optional<Trial> fitted;
};

/// Are two laws the same but for one place?
bool differ_at(const std::vector<std::size_t>& a, const std::vector<std::size_t>& b, std::size_t place) {
  for (std::size_t i = 0; i < a.size(); ++i) {
    if ((a[i] != b[i]) != (i == place)) return false;
  }
  return true;
}

}  // namespace

bool torque_only_loads(std::span<const Record> records, const Model& given) {
  const auto says_of_the_load = [&](const IncludedEffect& e) { return concerns_the_load(given.about(e.effect)); };
  return std::ranges::any_of(records, &Record::measured_load) && std::ranges::none_of(given.effects, says_of_the_load);
}

bool concerns_the_load(const EffectInfo& effect) {
  return effect.stage == Stage::load || effect.reads == Signal::torque;
}

Model with_only_the_load_open(Model fitted, const Model& given) {
  fitted.withheld = given.withheld;
  withhold(fitted, [](const EffectInfo& effect) { return !concerns_the_load(effect); });
  for (std::size_t i = 0; i < fitted.names().size(); ++i) {
    fitted.at(i).fixed = true;
    fitted.at(i).pinned = false;
  }
  return fitted;
}

bool follows_the_torque(const Loss& without, double mean_square) {
  constexpr double a_fifth = 0.2;  // by hand
  return mean_square - 1 <= a_fifth * a_fifth * (without.mean_square(Signal::torque) - 1);
}

bool follows_the_torque(const Loss& without, const Loss& with) {
  return follows_the_torque(without, with.mean_square(Signal::torque));
}

std::optional<Finding> put_on(const Finding& law, const Trial& first, Trials& trials, const Criterion& criterion) {
  std::vector<Variant> variants{{law.effects, {}}};
  std::vector<Model> models{law.current.model()};
  for (const auto& [member, rivals] : law.rivals) {
    for (const Rival& rival : rivals) {
      variants.push_back({law.effects, {}});
      std::ranges::replace(variants.back().effects, member, rival.effect);
      models.push_back(rival.model);
    }
  }
  for (std::size_t i = 0; i < variants.size(); ++i) {
    const Model model = on_top_of(first.model(), models[i], variants[i].effects);
    variants[i].fitted = trials.fit(model, nullptr);
  }
  std::erase_if(variants, [](const Variant& v) { return !v.fitted; });
  if (variants.empty()) return std::nullopt;
  const Variant best = *std::ranges::max_element(variants, [](const Variant& a, const Variant& b) {
    return gain(*a.fitted->held_out.quality, *b.fitted->held_out.quality) > 0;
  });
  Finding found{*best.fitted, best.effects, {}, {}, {}, {}, law.candidates, {}};
  found.steps.push_back({"fitted", {}, first.train, first.held_out_error()});
  for (std::size_t place = 0; place < best.effects.size(); ++place) {
    const std::size_t effect = best.effects[place];
    const std::string id(first.model().about(effect).id);
    found.steps.push_back({"added " + id, effect, found.current.train, found.current.held_out_error()});
    found.before.insert_or_assign(effect, first.held_out);
    for (const Variant& other : variants) {
      if (!differ_at(best.effects, other.effects, place)) continue;
      if (!criterion.tied(found.current.held_out, other.fitted->held_out)) continue;
      found.rivals[effect].push_back({other.effects[place], other.fitted->model()});
    }
  }
  return found;
}

Trial without_effects_of_the_load(Trial fitted) {
  withhold(fitted.fit.model,
           [](const EffectInfo& effect) { return concerns_the_load(effect) && !effect.corrects_load; });
  return fitted;
}

Finding with_law(Finding law, Finding found) {
  const auto prepend = [](auto& all, auto first) {
    first.insert(first.end(), std::make_move_iterator(all.begin()), std::make_move_iterator(all.end()));
    all = std::move(first);
  };
  found.before.merge(law.before);
  found.rivals.merge(law.rivals);
  if (!found.steps.empty() && !law.steps.empty())
    found.steps.erase(found.steps.begin());  // the fit that both begin with
  prepend(found.effects, std::move(law.effects));
  prepend(found.candidates, std::move(law.candidates));
  prepend(found.steps, std::move(law.steps));
  return found;
}

Readings leave_out(Dataset& data, const std::function<bool(Signal)>& these) {
  Readings readings;
  for (std::vector<Record>* const records : std::array{&data.train, &data.held_out}) {
    for (Record& record : *records) {
      auto& all = record.observations;
      const auto left = std::stable_partition(all.begin(), all.end(), [&](const auto& o) { return !these(o.signal); });
      readings.emplace_back(std::make_move_iterator(left), std::make_move_iterator(all.end()));
      all.erase(left, all.end());
    }
  }
  return readings;
}

void put_back(Dataset& data, Readings readings) {
  auto next = readings.begin();
  for (std::vector<Record>* const records : std::array{&data.train, &data.held_out}) {
    for (Record& record : *records) {
      std::ranges::move(*next, std::back_inserter(record.observations));
      ++next;
    }
  }
}

}  // namespace emtb
