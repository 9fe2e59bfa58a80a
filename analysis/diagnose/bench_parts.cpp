#include "analysis/diagnose/bench_parts.h"

#include <algorithm>
#include <sstream>

#include "analysis/diagnose/plausibility.h"
#include "model/catalogue.h"

namespace emtb {
namespace {

/// The effects that go by these ids.
std::vector<std::size_t> effects_named(const Model& model, const std::vector<std::string>& lists) {
  std::vector<std::size_t> named;
  for (const std::string& list : lists) {
    std::istringstream ids(list);
    for (std::string id; std::getline(ids, id, ',');) named.push_back(model.effect_named(id));
  }
  return named;
}

}  // namespace

BenchParts parts_of_bench(const Model& model, std::span<const Record> records) {
  const auto any = [&](auto holds) {
    return std::ranges::any_of(records,
                               [&](const Record& record) { return std::ranges::any_of(record.observations, holds); });
  };
  const auto read = [&](Signal signal) {
    return any([&](const Observation& o) { return o.signal == signal && o.origin == Origin::instrument; });
  };
  return {.driver = model.input == Signal::u_ref,
          .voltage = model.input != Signal::i_a,
          .field_winding = model.bench.field_winding.value_or(model.input != Signal::i_a),
          .tachogenerator = read(Signal::omega) && model.bench.tachogenerator.value_or(true),
          .torque_gauge = read(Signal::torque),
          .current = read(Signal::i_a)};
}

std::string_view missing_part(const EffectInfo& effect, const BenchParts& there) {
  const BenchParts& needed = effect.bench;
  if (needed.driver && !there.driver) return "the model does not begin with a driver's reference";
  if (needed.voltage && !there.voltage) return "a current drive shows nothing of the armature's circuit";
  if (needed.field_winding && !there.field_winding) return "no field winding is known of this motor";
  if (needed.tachogenerator && !there.tachogenerator) return "no tachogenerator reads the speed";
  if (needed.torque_gauge && !there.torque_gauge) return "no gauge reads the torque";
  if (needed.current && !there.current) return "no instrument reads the current";
  return {};
}

std::vector<Withheld> withheld_effects(const Model& model, std::span<const Record> records) {
  const BenchParts there = parts_of_bench(model, records);
  const bool turn_is_followed = finest_wave(records) >= 1;
  std::vector<Withheld> withheld;
  for (std::size_t effect = 0; effect < model.known_effects(); ++effect) {
    if (model.includes(effect)) continue;
    if (model.withholds(effect)) {
      withheld.push_back({effect, "left out on request"});
    } else if (const std::string_view why = missing_part(model.about(effect), there); !why.empty()) {
      withheld.push_back({effect, std::string(why)});
    } else if (model.about(effect).periodic && !turn_is_followed) {
      withheld.push_back({effect, "the shaft turns by more than half a turn from row to row"});
    }
  }
  return withheld;
}

void withhold_unwanted(Model& model, const Wanted& wanted) {
  std::vector<std::size_t> kept = effects_named(model, wanted.only);
  for (std::size_t i = 0; i < kept.size(); ++i) {  // grows
    if (const std::string_view needs = model.about(kept[i]).needs; !needs.empty()) kept.push_back(effect_index(needs));
  }
  const std::vector<std::size_t> left_out = effects_named(model, wanted.without);
  const auto holds = [](const std::vector<std::size_t>& effects, std::size_t effect) {
    return std::ranges::find(effects, effect) != effects.end();
  };
  for (std::size_t effect = 0; effect < model.known_effects(); ++effect) {
    if (holds(left_out, effect) || (!kept.empty() && !holds(kept, effect))) model.withheld.push_back(effect);
  }
}

}  // namespace emtb
