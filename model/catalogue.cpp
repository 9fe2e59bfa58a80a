#include "model/catalogue.h"

#include <algorithm>
#include <array>
#include <limits>
#include <string>
#include <utility>

#include "hal/did_you_mean.h"
#include "hal/error.h"
#include "model/structure.h"

namespace emtb {
namespace {

constexpr auto infos = []<class... Effect>(std::tuple<Effect...>*) {
  return std::array<EffectInfo, sizeof...(Effect)>{Effect::info...};
}(static_cast<AllEffects*>(nullptr));

/// What `ask.template operator()<Effect>()` answers for the effect at a place of the catalogue.
template <class Ask>
auto ask_effect(std::size_t effect, const Ask& ask) {
  static constexpr auto table = []<class... Effect>(std::tuple<Effect...>*) {
    return std::array{+[](const Ask& of) { return of.template operator()<Effect>(); }...};
  }(static_cast<AllEffects*>(nullptr));
  return table[effect](ask);
}

static_assert(std::ranges::is_sorted(infos, {}, &EffectInfo::stage),
              "AllEffects must stand in the order of the stages");

}  // namespace

std::string_view name_of(Stage stage) noexcept {
  constexpr std::array<std::string_view, 6> names{"driver", "armature", "air gap", "shaft", "load", "sensors"};
  return names[static_cast<std::size_t>(stage)];
}

std::span<const EffectInfo> effect_catalogue() noexcept { return infos; }

std::string no_such_effect(std::string_view id, std::vector<std::string> others) {
  std::vector<std::string> known = std::move(others);
  for (const EffectInfo& info : infos) known.emplace_back(info.id);
  std::string text = "unknown effect `" + std::string(id) + "`";
  if (const std::string guess = did_you_mean(id, known); !guess.empty()) return text + guess;
  for (std::size_t i = 0; i < known.size(); ++i) text += (i == 0 ? ". Known: " : ", ") + known[i];
  return text;
}

std::size_t effect_index(std::string_view id) {
  const auto found = std::ranges::find(infos, id, &EffectInfo::id);
  if (found == infos.end()) throw ModelError(no_such_effect(id, {}));
  return static_cast<std::size_t>(found - infos.begin());
}

bool is_steady(std::size_t effect) {
  return ask_effect(effect, []<class Effect>() { return Steady<Effect>; });
}

std::vector<StartValues> starts_of(std::size_t effect, const Ranges& seen) {
  return ask_effect(effect, [&]<class Effect>() -> std::vector<StartValues> {
    if constexpr (requires { Effect::starts(seen); }) {
      return Effect::starts(seen);
    } else {
      StartValues nulls{};
      for (std::size_t i = 0; i < Effect::info.parameter_count; ++i) nulls[i] = Effect::info.parameter_list[i].null;
      return {nulls};
    }
  });
}

std::vector<StartValues> starts_beside_what_it_needs(std::size_t effect, const Ranges& seen) {
  return ask_effect(effect, [&]<class Effect>() -> std::vector<StartValues> {
    if constexpr (requires { Effect::starts_beside(seen); }) {
      return Effect::starts_beside(seen);
    } else {
      return {};
    }
  });
}

double twist_under(std::size_t effect, std::span<const double> values, double torque) {
  return ask_effect(effect, [&]<class Effect>() -> double {
    if constexpr (requires { Effect::twist_under(values, torque); }) {
      return Effect::twist_under(values, torque);
    } else {
      return 0;
    }
  });
}

std::string full_name(const EffectInfo& effect, std::size_t parameter) {
  return std::string(effect.id) + "." + std::string(effect.parameters()[parameter].symbol);
}

std::string implausible(std::size_t effect, std::span<const double> values, const FittedMachine& machine) {
  return ask_effect(effect, [&]<class Effect>() -> std::string {
    if constexpr (requires { Effect::implausible(values, machine); }) {
      return Effect::implausible(values, machine);
    } else {
      return {};
    }
  });
}

std::string needs_of(const EffectInfo& effect) {
  const BenchParts& bench = effect.bench;
  std::string all(effect.needs);
  const auto add = [&](bool needed, const char* what) {
    if (needed) all += (all.empty() ? "" : ", ") + std::string(what);
  };
  add(bench.driver, "a driver that a reference drives");
  add(bench.voltage, "a voltage that feeds the armature");
  add(bench.field_winding, "a field winding");
  add(bench.tachogenerator, "a tachogenerator");
  add(bench.torque_gauge, "a torque gauge");
  add(bench.current, "a measured current");
  return all;
}

std::vector<std::size_t> watched_effects() {
  std::vector<std::size_t> watched;
  for (std::size_t effect = 0; effect < effect_count; ++effect) {
    if (infos[effect].watch) watched.push_back(effect);
  }
  std::ranges::sort(watched, {}, [](std::size_t effect) { return infos[effect].watch->rank; });
  return watched;
}

double size_at(std::size_t effect, double share, const Ranges& seen) {
  return ask_effect(effect, [&]<class Effect>() -> double {
    if constexpr (Effect::info.watch.has_value()) {
      return Effect::size_at(share, seen);
    } else {
      return std::numeric_limits<double>::quiet_NaN();
    }
  });
}

std::size_t ModelStructure::parameter_count() const {
  std::size_t count = base_count;
  for (const std::size_t effect : effects) count += infos[effect].parameter_count;
  for (const PlacedTerm& term : terms) count += term.parameter_count;
  return count;
}

}  // namespace emtb
