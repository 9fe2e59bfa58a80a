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
  static constexpr auto table = []<class... Effect>(std::tuple<Effect...>*) {
    return std::array<bool, sizeof...(Effect)>{Steady<Effect>...};
  }(static_cast<AllEffects*>(nullptr));
  return table[effect];
}

std::vector<StartValues> starts_of(std::size_t effect, const Ranges& seen) {
  using Starts = std::vector<StartValues> (*)(const Ranges&);
  static constexpr auto table = []<class... Effect>(std::tuple<Effect...>*) {
    return std::array<Starts, sizeof...(Effect)>{[](const Ranges& ranges) {
      if constexpr (requires { Effect::starts(ranges); }) {
        return Effect::starts(ranges);
      } else {
        StartValues nulls{};
        for (std::size_t i = 0; i < Effect::info.parameter_count; ++i) nulls[i] = Effect::info.parameter_list[i].null;
        return std::vector{nulls};
      }
    }...};
  }(static_cast<AllEffects*>(nullptr));
  return table[effect](seen);
}

std::vector<StartValues> starts_beside_what_it_needs(std::size_t effect, const Ranges& seen) {
  using Starts = std::vector<StartValues> (*)(const Ranges&);
  static constexpr auto table = []<class... Effect>(std::tuple<Effect...>*) {
    return std::array<Starts, sizeof...(Effect)>{[](const Ranges& ranges) {
      if constexpr (requires { Effect::starts_beside(ranges); }) {
        return Effect::starts_beside(ranges);
      } else {
        return std::vector<StartValues>();
      }
    }...};
  }(static_cast<AllEffects*>(nullptr));
  return table[effect](seen);
}

double twist_under(std::size_t effect, std::span<const double> values, double torque) {
  using Twist = double (*)(std::span<const double>, double);
  static constexpr auto table = []<class... Effect>(std::tuple<Effect...>*) {
    return std::array<Twist, sizeof...(Effect)>{[](std::span<const double> p, double on_it) {
      if constexpr (requires { Effect::twist_under(p, on_it); }) {
        return Effect::twist_under(p, on_it);
      } else {
        return 0.0;
      }
    }...};
  }(static_cast<AllEffects*>(nullptr));
  return table[effect](values, torque);
}

std::string full_name(const EffectInfo& effect, std::size_t parameter) {
  return std::string(effect.id) + "." + std::string(effect.parameters()[parameter].symbol);
}

std::string implausible(std::size_t effect, std::span<const double> values, const FittedMachine& machine) {
  using Implausible = std::string (*)(std::span<const double>, const FittedMachine&);
  static constexpr auto table = []<class... Effect>(std::tuple<Effect...>*) {
    return std::array<Implausible, sizeof...(Effect)>{[](std::span<const double> p, const FittedMachine& m) {
      if constexpr (requires { Effect::implausible(p, m); }) {
        return Effect::implausible(p, m);
      } else {
        return std::string();
      }
    }...};
  }(static_cast<AllEffects*>(nullptr));
  return table[effect](values, machine);
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
  using SizeAt = double (*)(double, const Ranges&);
  static constexpr auto table = []<class... Effect>(std::tuple<Effect...>*) {
    return std::array<SizeAt, sizeof...(Effect)>{[](double part, const Ranges& ranges) {
      if constexpr (Effect::info.watch.has_value()) {
        return Effect::size_at(part, ranges);
      } else {
        return std::numeric_limits<double>::quiet_NaN();
      }
    }...};
  }(static_cast<AllEffects*>(nullptr));
  return table[effect](share, seen);
}

std::size_t ModelStructure::parameter_count() const {
  std::size_t count = base_count;
  for (const std::size_t effect : effects) count += infos[effect].parameter_count;
  for (const PlacedTerm& term : terms) count += term.parameter_count;
  return count;
}

}  // namespace emtb
