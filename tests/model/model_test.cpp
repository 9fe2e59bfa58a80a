#include "model/model.h"

#include <gmock/gmock.h>

#include "hal/error.h"
#include "model/catalogue.h"

namespace emtb {
namespace {

using testing::ElementsAre;

Model servo_machine() {
  Model m;
  m.name = "servo";
  const double values[] = {1.2, 0.042, 0.05, 1e-5, 6e-5};
  for (std::size_t i = 0; i < base_parameters.size(); ++i) {
    m.base.push_back({.symbol = std::string(base_parameters[i].symbol),
                      .unit = std::string(base_parameters[i].unit),
                      .value = values[i],
                      .min = 0.1 * values[i],
                      .max = 10 * values[i],
                      .fixed = false,
                      .prior = {},
                      .std_error = {}});
  }
  return m;
}

TEST(Model, IncludesAnEffectAtItsNullValueInTheOrderOfTheCatalogue) {
  Model m = servo_machine();
  m.include(effect_index("tacho_lag"));
  m.include(effect_index("coulomb_friction"));
  ASSERT_EQ(m.effects.size(), 2U);
  EXPECT_EQ(m.effects[0].effect, effect_index("coulomb_friction"));
  EXPECT_EQ(m.effects[1].effect, effect_index("tacho_lag"));
  const EffectParameter& known = effect_catalogue()[effect_index("coulomb_friction")].parameter_list[0];
  const Parameter& T_c = m.effects[0].parameters[0];
  EXPECT_EQ(T_c.symbol, "T_c");
  EXPECT_EQ(T_c.unit, "N m");
  EXPECT_EQ(T_c.value, known.null);
  EXPECT_EQ(T_c.min, known.min);
  EXPECT_EQ(T_c.max, known.max);
  EXPECT_FALSE(T_c.fixed);
}

TEST(Model, IncludesASupplyNearTheDriversLimit) {
  const std::size_t bridge = effect_index("pwm_drive");
  Model m = servo_machine();
  m.driver = DriverModel{.min = -12, .max = 12};
  m.include(bridge);
  const Parameter V_s = m.parameters_of(bridge)[1];
  EXPECT_EQ(V_s.value, 12);
  EXPECT_NEAR(V_s.min, 9, 1e-9);
  EXPECT_NEAR(V_s.max, 15.6, 1e-9);
  m.exclude(bridge);
  m.driver = DriverModel{};
  m.include(bridge);
  EXPECT_EQ(m.parameters_of(bridge)[1].max, effect_catalogue()[bridge].parameter_list[1].max) << "no limit is known";
}

TEST(Model, IncludingAgainKeepsTheValueThatWasFound) {
  Model m = servo_machine();
  const std::size_t coulomb = effect_index("coulomb_friction");
  m.include(coulomb);
  m.effects[0].parameters[0].value = 0.003;
  m.include(coulomb);
  ASSERT_EQ(m.effects.size(), 1U);
  EXPECT_EQ(m.effects[0].parameters[0].value, 0.003);
}

TEST(Model, ExcludesAnEffect) {
  Model m = servo_machine();
  m.include(effect_index("coulomb_friction"));
  m.include(effect_index("windage"));
  m.exclude(effect_index("coulomb_friction"));
  EXPECT_FALSE(m.includes(effect_index("coulomb_friction")));
  EXPECT_TRUE(m.includes(effect_index("windage")));
  m.exclude(effect_index("coulomb_friction"));  // twice is once
  EXPECT_EQ(m.effects.size(), 1U);
}

TEST(Model, NamesItsParametersInTheOrderOfTheStructure) {
  Model m = servo_machine();
  m.include(effect_index("tacho_lag"));
  m.include(effect_index("driver_dead_zone"));
  EXPECT_THAT(m.names(), ElementsAre("R_a", "K_b", "K_m", "B", "J", "driver_dead_zone.u_d", "tacho_lag.tau"));
  EXPECT_EQ(m.structure().parameter_count(), 7U);
  m.at(5).value = 0.1;
  m.at(6).value = 0.2;
  EXPECT_THAT(m.values(), ElementsAre(1.2, 0.042, 0.05, 1e-5, 6e-5, 0.1, 0.2));
  EXPECT_THROW(m.at(7), ModelError);
}

TEST(Model, StructureHasTheDriverAndLeavesWhatIsMeasuredToTheData) {
  Model m = servo_machine();
  EXPECT_EQ(m.structure().driver.gain, 1);  // ideal
  m.driver = DriverModel{.gain = 4};
  m.input = Signal::e_a;
  EXPECT_EQ(m.structure().driver.gain, 4);
  EXPECT_EQ(m.structure().input, Signal::e_a);
  EXPECT_FALSE(m.structure().measured_voltage);
  EXPECT_FALSE(m.structure().measured_load);
}

TEST(FreeParameters, AreAllButTheFixedAndTheTied) {
  Model m = servo_machine();
  m.tie = {{"K_m", "K_b"}};
  m.at(0).fixed = true;
  m.include(effect_index("coulomb_friction"));
  const FreeParameters free(m);
  EXPECT_THAT(free.places(), ElementsAre(1, 3, 4, 5));
  EXPECT_THAT(free.pick({}), ElementsAre(0.042, 1e-5, 6e-5, 0));
  EXPECT_THAT(free.pick(std::vector<double>{9, 8, 7, 6, 5, 4}), ElementsAre(8, 6, 5, 4));
  EXPECT_THAT(free.spread(std::vector<double>{0.1, 0.2, 0.3, 0.4}), ElementsAre(1.2, 0.1, 0.1, 0.2, 0.3, 0.4));
}

TEST(FreeParameters, ATiedParameterFollowsItsLeader) {
  Model m = servo_machine();
  m.tie = {{"K_m", "K_b"}};
  EXPECT_EQ(m.values()[2], 0.042);  // whatever the file says of K_m
  const FreeParameters free(m);
  EXPECT_EQ(free.mover(2), free.mover(1));
  EXPECT_EQ(free.mover(2), 1U);
  m.at(1).fixed = true;
  const FreeParameters fixed(m);
  EXPECT_FALSE(fixed.mover(2));  // a leader that stands still
  EXPECT_EQ(fixed.spread(fixed.pick({}))[2], 0.042);
}

TEST(FreeParameters, TheTieOfAnAbsentEffectMeansNothing) {
  Model m = servo_machine();
  m.tie = {{"coulomb_friction.T_c", "B"}};
  EXPECT_EQ(FreeParameters(m).size(), 5U);
  m.include(effect_index("coulomb_friction"));
  EXPECT_EQ(FreeParameters(m).size(), 5U);
  EXPECT_EQ(m.values()[5], 1e-5);
}

}  // namespace
}  // namespace emtb
