#include "model/catalogue.h"

#include <gmock/gmock.h>

#include <map>
#include <set>
#include <string>

#include "hal/error.h"

namespace emtb {
namespace {

using testing::AllOf;
using testing::HasSubstr;

/// The ids and parameters of the contract. Files, commands and checks rely on them.
const std::map<std::string_view, std::set<std::string_view>> contract{
    {"driver_gain_error", {"k", "e_0"}},
    {"driver_slew", {"rise", "fall"}},
    {"driver_dead_zone", {"u_d"}},
    {"driver_saturation", {"e_max"}},
    {"driver_output_resistance", {"R_o"}},
    {"driver_lag", {"tau"}},
    {"driver_delay", {"t_d"}},
    {"one_quadrant_driver", {}},
    {"discontinuous_conduction", {"V_d", "i_c"}},
    {"armature_inductance", {"L_a"}},
    {"brush_drop", {"V_b", "i_lin"}},  // the knee is ours
    {"armature_heating", {"C_th", "R_th"}},
    {"armature_reaction", {"k_i", "i_k"}},
    {"field_heating", {"drop", "tau"}},
    {"coulomb_friction", {"T_c"}},
    {"stribeck_friction", {"T_s", "omega_s"}},
    {"asymmetric_friction", {"T_d", "B_d"}},
    {"windage", {"c_w"}},
    {"friction_warmup", {"drop", "tau"}},
    {"cogging", {"T_cog", "N", "phase"}},
    {"shaft_compliance", {"k", "d", "J_2"}},
    {"backlash", {"gap"}},
    {"load_torque", {"T_L"}},
    {"eccentric_load", {"T_e", "phase"}},
    {"eddy_brake", {"T_b", "omega_b"}},
    {"tacho_lag", {"tau"}},
    {"tacho_ripple", {"r", "N", "phase"}},
    {"tacho_offset", {"omega_0"}},
    {"torque_lag", {"tau"}},
    {"torque_offset", {"T_0"}},
    {"current_offset", {"i_0"}}};

TEST(Catalogue, HoldsOnlyEffectsOfTheContractWithTheirParameters) {
  std::set<std::string_view> seen;
  for (const EffectInfo& effect : effect_catalogue()) {
    SCOPED_TRACE(effect.id);
    EXPECT_TRUE(seen.insert(effect.id).second) << "twice";
    ASSERT_TRUE(contract.contains(effect.id));
    std::set<std::string_view> symbols;
    for (const EffectParameter& p : effect.parameters()) EXPECT_TRUE(symbols.insert(p.symbol).second) << p.symbol;
    EXPECT_EQ(symbols, contract.at(effect.id));
  }
}

TEST(Catalogue, TellsOfEveryEffectWhatAPersonNeedsToKnow) {
  for (const EffectInfo& effect : effect_catalogue()) {
    SCOPED_TRACE(effect.id);
    for (const std::string_view text : {effect.name, effect.equation, effect.what, effect.shows, effect.told_apart,
                                        effect.source, name_of(effect.stage)}) {
      EXPECT_GT(text.size(), 3U);
    }
    for (const std::string_view sentence : {effect.what, effect.shows, effect.told_apart})
      EXPECT_TRUE(sentence.ends_with('.'));
  }
}

TEST(Catalogue, EveryNullLiesWithinItsBounds) {
  for (const EffectInfo& effect : effect_catalogue()) {
    for (const EffectParameter& p : effect.parameters()) {
      SCOPED_TRACE(std::string(effect.id) + "." + std::string(p.symbol));
      EXPECT_FALSE(p.unit.empty());
      EXPECT_LT(p.min, p.max);
      EXPECT_GE(p.null, p.min);
      EXPECT_TRUE(p.null <= p.max || p.null == infinity);
    }
    if (effect.opposes_motion) {
      EXPECT_GE(effect.parameters()[0].min, 0) << effect.id << " could push";
    }
  }
}

TEST(Catalogue, FindsEveryEffectByItsId) {
  for (std::size_t i = 0; i < effect_count; ++i) EXPECT_EQ(effect_index(effect_catalogue()[i].id), i);
}

TEST(Catalogue, NamesTheKnownIdsWhereOneIsUnknown) {
  try {
    effect_index("coulomb");
    FAIL() << "`coulomb` was accepted";
  } catch (const ModelError& e) {
    EXPECT_THAT(e.what(),
                AllOf(HasSubstr("unknown effect `coulomb`"), HasSubstr("coulomb_friction"), HasSubstr("tacho_lag")));
  }
}

TEST(Catalogue, StandsInTheOrderOfTheStages) {
  EXPECT_TRUE(std::ranges::is_sorted(effect_catalogue(), {}, &EffectInfo::stage));
}

}  // namespace
}  // namespace emtb
