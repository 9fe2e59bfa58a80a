#include "drivers/simulated/plant_parameters.h"

#include <cmath>
#include <string>

#include "hal/error.h"

namespace emtb::simulated {
namespace {

void demand(bool holds, const char* what) {
  if (!holds) throw ConfigError(std::string("simulated plant: ") + what);
}

void check(const DriverParameters& driver) {
  demand(std::isfinite(driver.gain) && std::isfinite(driver.offset), "driver.gain and offset must be finite");
  demand(driver.rise > 0 && driver.fall > 0, "driver.rise and driver.fall must be above 0");
  demand(driver.min < driver.max, "driver.min must be below driver.max");
  demand(driver.dead_zone >= 0 && driver.output_resistance >= 0 && driver.rectified >= 0 && driver.crest >= 0,
         "driver.dead_zone, output_resistance, rectified, crest must be 0 or more");
  demand(driver.knee >= 0 && driver.lag >= 0 && driver.sampling >= 0 && driver.play >= 0,
         "driver.knee, lag, sampling and play must be 0 or more");
  demand(driver.delay >= 0 && driver.delay <= 10, "driver.delay must be 0 to 10 s");
  demand(driver.conduction_rise >= 0 && driver.conduction_current > 0,
         "driver.conduction_rise must be 0 or more, conduction_current above 0");
  demand(driver.chop_period >= 0 && driver.chop_supply > 0 && driver.chop_decay >= 0,
         "driver.chop_period and chop_decay must be 0 or more, chop_supply above 0");
}

void check(const MotorParameters& motor) {
  demand(motor.R_a > 0 && motor.J > 0, "motor.R_a and motor.J must be above 0");
  demand(motor.L_a >= 0 && motor.B >= 0 && motor.windage >= 0, "motor.L_a, B and windage must be 0 or more");
  demand(motor.windage_exponent >= 1 && motor.windage_exponent <= 3 && motor.windage_omega > 0,
         "motor.windage_exponent must be 1 to 3, windage_omega above 0");
  demand(motor.bearing_drag >= 0 && motor.bearing_exponent > 0 && motor.bearing_exponent <= 1,
         "motor.bearing_drag must be 0 or more, bearing_exponent above 0 and at most 1");
  demand(motor.brush_drop >= 0 && motor.brush_current > 0, "motor.brush_drop must be 0 or more, brush_current above 0");
  demand(std::isfinite(motor.K_b) && std::isfinite(motor.K_m), "motor.K_b and K_m must be finite");
  demand(motor.heat_resistance > 0 && motor.heat_capacity * motor.heat_resistance >= 0.01,
         "motor.heat_resistance must be above 0, and times heat_capacity 0.01 s or more");
  demand(motor.reaction >= 0 && motor.reaction < 0.5 && motor.reaction_current > 0,
         "motor.reaction must be 0 or more and below 0.5, reaction_current above 0");
  demand(motor.field_drop >= 0 && motor.field_drop < 0.9 && motor.field_time > 0,
         "motor.field_drop must be 0 or more and below 0.9, field_time above 0");
  demand(std::abs(motor.flux_hysteresis) < 0.5 && motor.coercive_current > 0,
         "motor.flux_hysteresis must be within +-0.5, coercive_current above 0");
}

void check(const FrictionParameters& friction) {
  demand(friction.T_c >= 0 && friction.T_s >= 0, "friction.T_c and T_s must be 0 or more");
  demand(friction.omega_s > 0 && friction.deflection > 0, "friction.omega_s and deflection must be above 0");
  demand(std::abs(friction.T_d) <= friction.T_c && std::isfinite(friction.B_d),
         "friction.T_d must be within +-T_c, B_d finite");
  demand(friction.B_d == 0 || friction.T_c > 0, "friction.B_d needs T_c");
  demand(friction.gears >= 0 && friction.gears < 1, "friction.gears must be 0 or more and below 1");
  demand(friction.gears == 0 || friction.T_c > 0, "friction.gears needs T_c");
  demand(friction.warm_drop >= 0 && friction.warm_drop < 1 && friction.warm_time > 0,
         "friction.warm_drop must be 0 or more and below 1, warm_time above 0");
}

void check(const ShaftParameters& shaft, double J) {
  demand(std::isfinite(shaft.cogging) && std::isfinite(shaft.cogging_second) && shaft.cogging_order > 0,
         "shaft.cogging and cogging_second must be finite, cogging_order above 0");
  demand(shaft.stiffness > 0 && shaft.damping >= 0 && shaft.gap >= 0,
         "shaft.stiffness must be above 0, damping and gap 0 or more");
  demand(shaft.stiffness == unlimited || (shaft.J_2 > 0 && shaft.J_2 < J),
         "shaft.stiffness needs a J_2 above 0 and below motor.J");
  demand(shaft.gap == 0 || shaft.stiffness != unlimited, "shaft.gap needs a stiffness");
}

void check(const SensorParameters& sensors) {
  demand(sensors.tacho_lag >= 0 && sensors.torque_lag >= 0 && sensors.tacho_stick >= 0,
         "sensors.tacho_lag, torque_lag and tacho_stick must be 0 or more");
  demand(std::isfinite(sensors.supply) && sensors.supply >= 0, "sensors.supply must be 0 V or more");
  demand(sensors.delay >= 0 && sensors.delay <= 10, "sensors.delay must be 0 to 10 s");
  demand(std::isfinite(sensors.ripple) && std::isfinite(sensors.ripple_second) && sensors.ripple_order > 0,
         "sensors.ripple and ripple_second must be finite, ripple_order above 0");
}

}  // namespace

void check(const LoadParameters& load) {
  demand(std::isfinite(load.torque) && load.brake >= 0 && load.eddy_torque >= 0 && load.eddy_omega > 0,
         "load.torque must be finite, brake and eddy_torque 0 or more, eddy_omega above 0");
  demand(std::isfinite(load.spring_torque) && load.spring >= 0, "load.spring_torque must be finite, spring 0 or more");
  demand(std::isfinite(load.eccentric) && load.eddy_heating >= 0,
         "load.eccentric must be finite, eddy_heating 0 or more");
}

void check(const PlantParameters& p) {
  check(p.driver);
  check(p.motor);
  check(p.friction);
  check(p.shaft, p.motor.J);
  check(p.load);
  check(p.sensors);
}

}  // namespace emtb::simulated
