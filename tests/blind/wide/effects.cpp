#include "tests/blind/wide/effects.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "tests/blind/wide/outside.h"

namespace emtb::blind::wide {
namespace {

using simulated::Laws;
using Truth = std::vector<TrueParameter>;

bool usual(const WideBench& b) { return b.plant.laws == Laws::usual; }

// What a bench must have

bool has_reference(const WideBench& b) { return b.logs_reference; }
bool has_current(const WideBench& b) { return b.find(Signal::i_a) != nullptr; }
bool has_tacho(const WideBench& b) { return b.find(Signal::omega) != nullptr; }
bool no_gauge(const WideBench& b) { return b.find(Signal::torque) == nullptr; }
bool has_gauge(const WideBench& b) { return !no_gauge(b); }
bool turns(const WideBench& b) { return !b.machine.linear; }
bool turns_without_gauge(const WideBench& b) { return turns(b) && no_gauge(b); }
/// Nobody asks for a speed of what a spring holds.
bool may_hold_a_place(const WideBench& b) { return no_gauge(b) && b.loop != Loop::speed; }
bool turns_with_tacho(const WideBench& b) { return turns(b) && has_tacho(b); }
bool both_ways(const WideBench& b) { return b.machine.both_ways; }
bool one_way(const WideBench& b) { return has_reference(b) && !b.machine.both_ways; }
/// A driver that takes no current back: with an output that crosses zero slowly there is none.
bool may_take_none_back(const WideBench& b) {
  return has_reference(b) && (!b.machine.both_ways || !std::isfinite(b.machine.slew));
}
bool terminal_and_reference(const WideBench& b) { return has_reference(b) && b.find(Signal::e_a) != nullptr; }
bool terminal_and_current(const WideBench& b) { return terminal_and_reference(b) && has_current(b); }
/// Runs that last long enough for something to warm up.
bool long_runs(const WideBench& b) {
  return std::ranges::any_of(b.train, [](const Experiment& e) { return e.target.duration() - e.begin > 12; });
}
bool long_with_current(const WideBench& b) { return long_runs(b) && has_current(b); }
/// Rows that follow a wave of so many periods a turn.
double finest_order(const WideBench& b) { return 1 / (0.3 * b.machine.speed * b.period); }
bool fine_enough(const WideBench& b) { return turns(b) && finest_order(b) > 2; }
bool fine_tacho(const WideBench& b) { return turns_with_tacho(b) && finest_order(b) > 2; }

double order_up_to(const WideBench& b, std::initializer_list<double> orders, Draw& draw) {
  const double wanted = draw.one_of(orders);
  return std::min(wanted, std::max(2.0, std::floor(finest_order(b))));
}

// Driver

Truth gain_error(WideBench& b, double size, Draw draw) {
  const double k = draw.sign() * 0.01 * size, e_0 = draw.sign() * 0.01 * b.machine.voltage * size;
  b.plant.driver.gain *= 1 + k;
  b.plant.driver.offset = e_0;
  return {{"k", k}, {"e_0", e_0}};
}

Truth slew(WideBench& b, double size, Draw draw) {
  auto& driver = b.plant.driver;
  const bool known = std::isfinite(b.machine.slew);
  const double longer = known ? 0.2 * size : 0.3 * b.machine.tau * size;
  driver.rise = known ? driver.rise / (1 + longer) : b.machine.voltage / longer;
  driver.fall = known ? driver.fall / (1 + longer * draw.within(0.3, 1)) : driver.rise * draw.within(1, 1.5);
  return {{"rise", driver.rise}, {"fall", driver.fall}};
}

Truth dead_zone(WideBench& b, double size, Draw) {
  b.plant.driver.dead_zone = 0.03 * b.machine.voltage / b.machine.gain * size;
  return {{"u_d", b.plant.driver.dead_zone}};
}

Truth saturates(WideBench& b, double size, Draw) {
  auto& driver = b.plant.driver;
  driver.max = b.machine.voltage * (1 - std::min(0.08 * size, 0.5));
  if (driver.min < 0) driver.min = -driver.max;
  if (!usual(b)) driver.knee = 0.004 * b.machine.voltage;
  return {{"e_max", driver.max}};
}

Truth limits_the_current(WideBench& b, double size, Draw) {
  b.plant.driver.current_limit = b.machine.voltage / b.machine.R * std::max(0.6 - 0.1 * size, 0.1);
  return {{"i_max", b.plant.driver.current_limit}};
}

Truth output_resistance(WideBench& b, double size, Draw) {
  b.plant.driver.output_resistance = 0.15 * b.machine.R * size;
  return {{"R_o", b.plant.driver.output_resistance}};
}

Truth driver_lag(WideBench& b, double size, Draw) {
  b.plant.driver.lag = std::max(b.period, 0.1 * b.machine.tau) * size;
  return {{"tau", b.plant.driver.lag}};
}

Truth driver_delay(WideBench& b, double size, Draw) {
  const double t_d =
      std::max(1, static_cast<int>(std::max(0.1 * b.machine.tau / b.period, 1.0) * size)) * b.period + b.period;
  b.plant.driver.delay = usual(b) ? t_d : 0.9 * t_d;
  if (!usual(b)) b.plant.driver.sampling = 0.2 * t_d;
  return {{"t_d", t_d}};
}

Truth one_quadrant(WideBench& b, double, Draw) {
  b.plant.driver.one_quadrant = true;
  return {};
}

/// A bridge that opens its switches where it is asked for nothing.
Truth lets_go(WideBench& b, double, Draw) {
  b.plant.driver.coasts = true;
  return {};
}

Truth conduction(WideBench& b, double size, Draw draw) {
  b.plant.driver.conduction_rise = 0.04 * b.machine.voltage * size;
  b.plant.driver.conduction_current = b.machine.current * draw.within(0.1, 0.3);
  return {{"V_d", b.plant.driver.conduction_rise}, {"i_c", b.plant.driver.conduction_current}};
}

/// A bridge whose current runs on against its diodes alone.
Truth chops(WideBench& b, double, Draw draw) {
  auto& driver = b.plant.driver;
  driver.chop_period = std::pow(10, draw.within(-1.3, 0.5));
  driver.chop_supply = b.machine.voltage * draw.within(1, 1.3);
  const double k = draw.within(0, 0.1);
  driver.chop_decay = k * driver.chop_supply;
  return {{"r", driver.chop_period}, {"V_s", driver.chop_supply}, {"k", k}};
}

// Armature and air gap

Truth inductance(WideBench& b, double size, Draw) {
  b.plant.motor.L_a = std::max(0.1 * b.machine.tau, 0.3 * b.period) * b.machine.R * size;
  return {{"L_a", b.plant.motor.L_a}};
}

Truth brushes(WideBench& b, double size, Draw draw) {
  b.plant.motor.brush_drop = 0.03 * b.machine.voltage * size;
  b.plant.motor.brush_current = b.machine.current * draw.within(0.02, 0.06);
  return {{"V_b", b.plant.motor.brush_drop}};
}

Truth heats(WideBench& b, double size, Draw draw) {
  auto& motor = b.plant.motor;
  const double loss = b.machine.R * b.machine.current * b.machine.current;  // [W]
  motor.heat_resistance = 60 / loss * std::sqrt(size);
  motor.heat_capacity = draw.log_within(12, 60) / motor.heat_resistance / std::sqrt(size);
  return {{"C_th", motor.heat_capacity}, {"R_th", motor.heat_resistance}};
}

/// Never so much that two currents would do at one speed and voltage: such a machine runs away, and is built with
/// windings against it.
Truth armature_reaction(WideBench& b, double size, Draw draw) {
  constexpr double steepest = 0.65, short_of_it = 0.7;  // slope of x²/(1 + x²); share, by hand
  auto& motor = b.plant.motor;
  motor.reaction_current = b.machine.current * draw.within(0.7, 2);
  const double leaps = b.machine.R * motor.reaction_current / (steepest * b.machine.K * b.machine.speed);
  motor.reaction = std::min({0.1 * size, 0.45, short_of_it * leaps});
  return {{"k_i", motor.reaction}, {"i_k", motor.reaction_current}};
}

Truth field_heats(WideBench& b, double size, Draw draw) {
  b.plant.motor.field_drop = std::min(0.05 * size, 0.5);
  b.plant.motor.field_time = draw.log_within(12, 100);
  return {{"drop", b.plant.motor.field_drop}, {"tau", b.plant.motor.field_time}};
}

// Shaft

Truth coulomb(WideBench& b, double size, Draw) {
  b.plant.friction.T_c = 0.08 * b.machine.torque * size;
  return {{"T_c", b.plant.friction.T_c}};
}

Truth stribeck_friction(WideBench& b, double size, Draw draw) {
  auto& friction = b.plant.friction;
  friction.T_s = 0.08 * b.machine.torque * size;
  friction.omega_s = b.machine.speed * draw.log_within(0.03, 0.12);
  return {{"T_s", friction.T_s}, {"omega_s", friction.omega_s}};
}

Truth asymmetric(WideBench& b, double size, Draw draw) {
  auto& friction = b.plant.friction;
  friction.T_d = draw.sign() * std::min(0.3 * size, 0.9) * friction.T_c;
  return {{"T_d", friction.T_d}, {"B_d", 0}};
}

Truth blows(WideBench& b, double size, Draw draw) {
  auto& motor = b.plant.motor;
  motor.windage = 0.15 * b.machine.torque / (b.machine.speed * b.machine.speed) * size;
  if (!usual(b)) motor.windage_exponent = draw.within(1.8, 2.2);
  motor.windage_omega = b.machine.speed;
  return {{"c_w", motor.windage}};
}

Truth grease_warms(WideBench& b, double size, Draw draw) {
  b.plant.friction.warm_drop = std::min(0.3 * size, 0.85);
  b.plant.friction.warm_time = draw.log_within(12, 80);
  return {{"drop", b.plant.friction.warm_drop}, {"tau", b.plant.friction.warm_time}};
}

Truth bearing_drags(WideBench& b, double size, Draw draw) {
  auto& motor = b.plant.motor;
  if (!usual(b)) motor.bearing_exponent = draw.within(0.5, 0.8);
  motor.bearing_drag = 0.15 * b.machine.torque / std::pow(b.machine.speed, motor.bearing_exponent) * size;
  return {{"c_b", motor.bearing_drag}};
}

Truth gears_press(WideBench& b, double size, Draw) {
  b.plant.friction.gears = std::min(0.1 * size, 0.6);
  return {{"k_l", b.plant.friction.gears}};
}

Truth bristle_bends(WideBench& b, double size, Draw) {
  auto& friction = b.plant.friction;
  friction.law = simulated::FrictionLaw::bristle;
  friction.deflection = 0.03 * b.machine.speed * b.machine.tau * size;
  return {{"sigma_0", friction.T_c / friction.deflection}};
}

Truth cogs(WideBench& b, double size, Draw draw) {
  auto& shaft = b.plant.shaft;
  shaft.cogging = 0.12 * b.machine.torque * size;
  shaft.cogging_order = order_up_to(b, {2, 4, 6, 8, 12, 14}, draw);
  shaft.cogging_phase = draw.phase();
  if (!usual(b)) shaft.cogging_second = 0.2;
  return {{"T_cog", shaft.cogging}};
}

Truth compliant(WideBench& b, double size, Draw draw) {
  auto& shaft = b.plant.shaft;
  const double share = draw.within(0.3, 0.6), J = b.machine.J;
  const double swings = std::min(draw.log_within(3, 8) / b.machine.tau, 0.8 / b.period) / std::sqrt(size);  // [rad/s]
  shaft.J_2 = share * J;
  const double reduced = share * (1 - share) * J;
  shaft.stiffness = reduced * swings * swings;
  shaft.damping = 2 * 0.05 * reduced * swings;
  return {{"k", shaft.stiffness}, {"d", shaft.damping}, {"J_2", shaft.J_2}};
}

Truth backlash(WideBench& b, double size, Draw) {
  b.plant.shaft.gap = 0.1 * b.machine.speed * b.machine.tau * size;
  return {{"gap", b.plant.shaft.gap}};
}

// Load

Truth weight(WideBench& b, double size, Draw draw) {
  b.plant.load.torque = (b.machine.both_ways ? draw.sign() : 1) * 0.12 * b.machine.torque * size;
  return {{"T_L", b.plant.load.torque}};
}

Truth brake_rubs(WideBench& b, double size, Draw) {
  b.plant.load.brake = 0.1 * b.machine.torque * size;
  return {{"T_b", b.plant.load.brake}};
}

Truth off_centre(WideBench& b, double size, Draw draw) {
  b.plant.load.eccentric = 0.15 * b.machine.torque * size;
  b.plant.load.eccentric_phase = draw.phase();
  return {{"T_e", b.plant.load.eccentric}};
}

/// A valve, a throttle: what stalls the motor winds the spring up by what it runs in five of its time constants, and by
/// six turns at most.
Truth spring_holds(WideBench& b, double size, Draw) {
  constexpr double six_turns = 38;  // [rad]
  const double runs = 5 * b.machine.speed * b.machine.tau, way = turns(b) ? std::min(runs, six_turns) : runs;
  b.plant.load.spring = b.machine.K * b.machine.voltage / b.machine.R / way * size;
  return {{"k", b.plant.load.spring}};
}

Truth eddy_currents(WideBench& b, double size, Draw draw) {
  auto& load = b.plant.load;
  load.eddy_torque = 0.2 * b.machine.torque * size;
  load.eddy_omega = b.machine.speed * draw.within(0.25, 0.6);
  return {{"T_b", load.eddy_torque}, {"omega_b", load.eddy_omega}};
}

// Sensors

Truth tacho_lags(WideBench& b, double size, Draw) {
  b.plant.sensors.tacho_lag = std::max(b.period, 0.1 * b.machine.tau) * size;
  return {{"tau", b.plant.sensors.tacho_lag}};
}

Truth tacho_ripples(WideBench& b, double size, Draw draw) {
  auto& sensors = b.plant.sensors;
  sensors.ripple = 0.02 * size;
  sensors.ripple_order = order_up_to(b, {1, 2, 2, 4, 6}, draw);
  sensors.ripple_phase = draw.phase();
  if (!usual(b)) sensors.ripple_second = 0.2;
  return {{"r", sensors.ripple}};
}

Truth tacho_reads_high(WideBench& b, double size, Draw draw) {
  const double offset = draw.sign() * 0.02 * b.machine.speed * size;
  b.find(Signal::omega)->offset = offset;
  return {{"omega_0", offset}};
}

Truth gauge_lags(WideBench& b, double size, Draw) {
  b.plant.sensors.torque_lag = std::max(b.period, 0.1 * b.machine.tau) * size;
  return {{"tau", b.plant.sensors.torque_lag}};
}

Truth gauge_reads_high(WideBench& b, double size, Draw draw) {
  const double offset = draw.sign() * 0.04 * b.machine.torque * size;
  b.find(Signal::torque)->offset = offset;
  return {{"T_0", offset}};
}

Truth current_reads_high(WideBench& b, double size, Draw draw) {
  const double offset = draw.sign() * 0.05 * b.machine.current * size;
  b.find(Signal::i_a)->offset = offset;
  return {{"i_0", offset}};
}

/// Beside the supply of a bridge, not the motor.
Truth current_is_the_supplys(WideBench& b, double, Draw draw) {
  b.plant.sensors.supply = b.machine.voltage * draw.within(1, 1.3);
  return {{"V_s", b.plant.sensors.supply}};
}

Truth speed_comes_late(WideBench& b, double size, Draw) {
  const double t_d = b.period + std::max(b.period, 0.1 * b.machine.tau) * size;
  if (Instrument* tacho = b.find(Signal::omega)) tacho->delay = t_d;
  b.encoder.delay = t_d;
  return {{"t_d", t_d}};
}

constexpr std::array all{
    WideEffect{.id = "driver_gain_error", .possible = terminal_and_reference, .hide = gain_error},
    WideEffect{.id = "driver_slew", .possible = has_reference, .hide = slew},
    WideEffect{.id = "driver_dead_zone", .possible = has_reference, .hide = dead_zone},
    WideEffect{.id = "driver_saturation", .possible = has_reference, .hide = saturates},
    WideEffect{.id = "current_limit", .possible = has_reference, .hide = limits_the_current},
    WideEffect{.id = "driver_output_resistance", .possible = terminal_and_current, .hide = output_resistance},
    WideEffect{.id = "driver_lag", .possible = has_reference, .hide = driver_lag},
    WideEffect{.id = "driver_delay", .possible = has_reference, .hide = driver_delay},
    WideEffect{.id = "one_quadrant_driver", .sized = false, .possible = may_take_none_back, .hide = one_quadrant},
    WideEffect{.id = "coasting_driver", .sized = false, .possible = has_reference, .hide = lets_go},
    WideEffect{.id = "discontinuous_conduction", .possible = one_way, .hide = conduction},
    WideEffect{.id = "pwm_drive", .sized = false, .possible = has_reference, .hide = chops},
    WideEffect{.id = "armature_inductance", .largest = 6, .hide = inductance},
    WideEffect{.id = "brush_drop", .hide = brushes},
    WideEffect{.id = "armature_heating", .given = "windage", .possible = long_with_current, .hide = heats},
    WideEffect{.id = "armature_reaction",
               .given = "windage",
               .largest = 4.5,
               .possible = has_current,
               .hide = armature_reaction},
    WideEffect{.id = "field_heating", .possible = long_with_current, .hide = field_heats},
    WideEffect{.id = "coulomb_friction", .hide = coulomb},
    WideEffect{.id = "stribeck_friction", .given = "coulomb_friction", .hide = stribeck_friction},
    WideEffect{.id = "asymmetric_friction",
               .given = "coulomb_friction",
               .largest = 3,
               .possible = both_ways,
               .hide = asymmetric},
    WideEffect{.id = "windage", .hide = blows},
    WideEffect{.id = "friction_warmup",
               .given = "coulomb_friction",
               .largest = 2.8,
               .possible = long_runs,
               .hide = grease_warms},
    WideEffect{.id = "bearing_drag", .hide = bearing_drags},
    WideEffect{.id = "load_dependent_friction", .given = "coulomb_friction", .hide = gears_press},
    WideEffect{.id = "presliding_friction", .given = "coulomb_friction", .hide = bristle_bends},
    WideEffect{.id = "cogging", .possible = fine_enough, .hide = cogs},
    WideEffect{.id = "shaft_compliance", .hide = compliant},
    WideEffect{.id = "backlash", .given = "shaft_compliance", .possible = both_ways, .hide = backlash},
    WideEffect{.id = "load_torque", .possible = no_gauge, .hide = weight},
    WideEffect{.id = "dry_brake", .possible = no_gauge, .hide = brake_rubs},
    WideEffect{.id = "eccentric_load", .possible = turns_without_gauge, .hide = off_centre},
    WideEffect{.id = "spring_load", .possible = may_hold_a_place, .hide = spring_holds},
    WideEffect{.id = "eddy_brake", .possible = no_gauge, .hide = eddy_currents},
    WideEffect{.id = "tacho_lag", .possible = has_tacho, .hide = tacho_lags},
    WideEffect{.id = "tacho_ripple", .possible = fine_tacho, .hide = tacho_ripples},
    WideEffect{.id = "tacho_offset", .possible = has_tacho, .hide = tacho_reads_high},
    WideEffect{.id = "torque_lag", .possible = has_gauge, .hide = gauge_lags},
    WideEffect{.id = "torque_offset", .possible = has_gauge, .hide = gauge_reads_high},
    WideEffect{.id = "current_offset", .possible = has_current, .hide = current_reads_high},
    WideEffect{.id = "supply_current", .sized = false, .possible = has_current, .hide = current_is_the_supplys},
    WideEffect{.id = "speed_delay", .hide = speed_comes_late},
    WideEffect{.id = "friction_bump", .outside = true, .hide = outside::friction_bump},
    WideEffect{.id = "sector_friction", .outside = true, .possible = fine_enough, .hide = outside::sector_friction},
    WideEffect{.id = "shaking", .outside = true, .hide = outside::shaking},
    WideEffect{.id = "flux_hysteresis", .outside = true, .possible = has_current, .hide = outside::flux_hysteresis},
    WideEffect{.id = "tacho_coupling", .outside = true, .possible = has_tacho, .hide = outside::tacho_coupling},
    WideEffect{.id = "brush_bounce", .outside = true, .hide = outside::brush_bounce},
    WideEffect{.id = "random_brake", .outside = true, .hide = outside::random_brake},
};

}  // namespace

std::span<const WideEffect> wide_effects() { return all; }

const WideEffect& wide_effect(std::string_view id) {
  const auto found = std::ranges::find(all, id, &WideEffect::id);
  if (found == all.end()) throw std::out_of_range("nothing to hide is called " + std::string(id));
  return *found;
}

std::vector<std::string> aliases(std::string_view truth, const WideBench& bench) {
  std::vector<std::string> right{std::string(truth)};
  const bool one_way = !bench.machine.both_ways && bench.loop == Loop::open;
  const auto also = [&](std::string_view a, std::string_view b, bool when) {
    if (!when) return;
    if (truth == a) right.emplace_back(b);
    if (truth == b) right.emplace_back(a);
  };
  also("load_torque", "coulomb_friction", one_way && no_gauge(bench));
  also("load_torque", "asymmetric_friction", no_gauge(bench));
  also("coulomb_friction", "asymmetric_friction", one_way);
  also("coulomb_friction", "dry_brake", no_gauge(bench));
  // Where the speed is all that is read, what comes late before the shaft or behind it is one thing.
  also("driver_delay", "speed_delay", !has_current(bench) && bench.find(Signal::e_a) == nullptr);
  also("driver_lag", "tacho_lag", !has_current(bench) && bench.find(Signal::e_a) == nullptr && bench.machine.both_ways);
  return right;
}

}  // namespace emtb::blind::wide
