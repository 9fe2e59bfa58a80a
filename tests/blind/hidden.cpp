#include "tests/blind/hidden.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace emtb::blind {
namespace {

using simulated::Laws;
using TrueValues = std::vector<TrueParameter>;

double pick(BenchKind kind, double slow, double fast) { return kind == BenchKind::slow ? slow : fast; }

simulated::DaqChannel* channel(Bench& bench, Signal signal) {
  const auto found = std::ranges::find(bench.channels, signal, &simulated::DaqChannel::signal);
  return found == bench.channels.end() ? nullptr : &*found;
}

bool usual(const Bench& bench) { return bench.plant.laws == Laws::usual; }

// Driver

TrueValues gain_error(Bench& bench, BenchKind kind, double size, Draw draw) {
  const double k = draw.sign() * 0.01 * size, e_0 = draw.sign() * pick(kind, 0.5, 0.1) * size;
  bench.plant.driver.gain *= 1 + k;
  bench.plant.driver.offset = e_0;
  return {{"k", k}, {"e_0", e_0}};
}

TrueValues slew(Bench& bench, BenchKind kind, double size, Draw draw) {
  auto& driver = bench.plant.driver;
  const double slower = pick(kind, 0.1, 2) * size;
  driver.rise /= 1 + slower;
  driver.fall /= 1 + slower * draw.within(0.3, 1);
  return {{"rise", driver.rise}, {"fall", driver.fall}};
}

TrueValues dead_zone(Bench& bench, BenchKind kind, double size, Draw) {
  bench.plant.driver.dead_zone = pick(kind, 0.1, 0.07) * size;
  return {{"u_d", bench.plant.driver.dead_zone}};
}

TrueValues saturates(Bench& bench, BenchKind kind, double size, Draw) {
  const double reached = pick(kind, 110, 20);  // [V] what the profiles ask for
  auto& driver = bench.plant.driver;
  driver.max = reached * (1 - 0.05 * size);
  if (kind == BenchKind::fast) driver.min = -driver.max;
  if (!usual(bench)) driver.knee = 0.004 * reached;
  return {{"e_max", driver.max}};
}

TrueValues output_resistance(Bench& bench, BenchKind kind, double size, Draw) {
  bench.plant.driver.output_resistance = pick(kind, 3, 0.2) * size;
  return {{"R_o", bench.plant.driver.output_resistance}};
}

TrueValues driver_lag(Bench& bench, BenchKind kind, double size, Draw) {
  bench.plant.driver.lag = pick(kind, 0.07, 0.01) * size;
  return {{"tau", bench.plant.driver.lag}};
}

TrueValues driver_delay(Bench& bench, BenchKind kind, double size, Draw) {
  const double t_d = pick(kind, 0.025, 0.005) * size;
  bench.plant.driver.delay = usual(bench) ? t_d : 0.85 * t_d;  // and half a sampling period on the mean
  if (!usual(bench)) bench.plant.driver.sampling = 0.3 * t_d;
  return {{"t_d", t_d}};
}

TrueValues one_quadrant(Bench& bench, BenchKind, double, Draw) {
  bench.plant.driver.one_quadrant = true;
  return {};
}

TrueValues conduction(Bench& bench, BenchKind, double size, Draw draw) {
  bench.plant.driver.conduction_rise = 3 * size;
  bench.plant.driver.conduction_current = draw.within(0.05, 0.15);
  return {{"V_d", bench.plant.driver.conduction_rise}, {"i_c", bench.plant.driver.conduction_current}};
}

// Armature and air gap

TrueValues inductance(Bench& bench, BenchKind kind, double size, Draw) {
  bench.plant.motor.L_a = pick(kind, 1, 0.002) * size;
  return {{"L_a", bench.plant.motor.L_a}};
}

TrueValues brushes(Bench& bench, BenchKind kind, double size, Draw draw) {
  bench.plant.motor.brush_drop = pick(kind, 1.5, 0.4) * size;
  bench.plant.motor.brush_current = pick(kind, 0.01, 0.05) * draw.within(0.7, 1.5);
  return {{"V_b", bench.plant.motor.brush_drop}};
}

TrueValues heats(Bench& bench, BenchKind kind, double size, Draw draw) {
  auto& motor = bench.plant.motor;
  motor.heat_capacity = pick(kind, 150, 6) / size;
  motor.heat_resistance = draw.within(1, 5) * size;
  return {{"C_th", motor.heat_capacity}, {"R_th", motor.heat_resistance}};
}

TrueValues armature_reaction(Bench& bench, BenchKind kind, double size, Draw draw) {
  auto& motor = bench.plant.motor;
  motor.reaction = std::min(0.1 * size, 0.45);
  motor.reaction_current = pick(kind, 0.5, 5) * draw.within(0.7, 1.4);
  return {{"k_i", motor.reaction}, {"i_k", motor.reaction_current}};
}

TrueValues field_heats(Bench& bench, BenchKind, double size, Draw draw) {
  bench.plant.motor.field_drop = std::min(0.04 * size, 0.5);
  bench.plant.motor.field_time = draw.log_within(15, 150);
  return {{"drop", bench.plant.motor.field_drop}, {"tau", bench.plant.motor.field_time}};
}

// Shaft

TrueValues coulomb(Bench& bench, BenchKind kind, double size, Draw) {
  bench.plant.friction.T_c = pick(kind, 0.045, 0.0025) * size;
  return {{"T_c", bench.plant.friction.T_c}};
}

TrueValues stribeck_friction(Bench& bench, BenchKind kind, double size, Draw draw) {
  auto& friction = bench.plant.friction;
  friction.T_s = pick(kind, 0.04, 0.003) * size;
  friction.omega_s = pick(kind, draw.within(4, 12), draw.within(10, 30));
  return {{"T_s", friction.T_s}, {"omega_s", friction.omega_s}};
}

TrueValues asymmetric(Bench& bench, BenchKind, double size, Draw draw) {
  auto& friction = bench.plant.friction;
  friction.T_d = draw.sign() * std::min(0.5 * size, 0.9) * friction.T_c;
  friction.B_d = draw.chance(0.5) ? draw.sign() * 0.2 * size * bench.plant.motor.B : 0;
  return {{"T_d", friction.T_d}, {"B_d", friction.B_d}};
}

TrueValues blows(Bench& bench, BenchKind kind, double size, Draw draw) {
  auto& motor = bench.plant.motor;
  motor.windage = pick(kind, 3e-6, 2e-8) * size;
  if (!usual(bench)) motor.windage_exponent = draw.within(1.8, 2.2);
  motor.windage_omega = pick(kind, 100, 300);
  return {{"c_w", motor.windage}};
}

TrueValues grease_warms(Bench& bench, BenchKind, double size, Draw draw) {
  bench.plant.friction.warm_drop = std::min(0.4 * size, 0.85);
  bench.plant.friction.warm_time = draw.log_within(15, 100);
  return {{"drop", bench.plant.friction.warm_drop}, {"tau", bench.plant.friction.warm_time}};
}

TrueValues cogs(Bench& bench, BenchKind kind, double size, Draw draw) {
  auto& shaft = bench.plant.shaft;
  shaft.cogging = pick(kind, 0.1, 0.01) * size;
  shaft.cogging_order = draw.one_of({2, 4, 6, 8, 12, 14});
  shaft.cogging_phase = draw.phase();
  if (!usual(bench)) shaft.cogging_second = 0.2;
  return {{"T_cog", shaft.cogging}};
}

/// A shaft whose two bodies swing against each other at a frequency.
void make_compliant(Bench& bench, double frequency, double share) {
  const double J = bench.plant.motor.J;
  const double swings = 6.283185307179586 * frequency;
  auto& shaft = bench.plant.shaft;
  shaft.J_2 = share * J;
  const double reduced = share * (1 - share) * J;
  shaft.stiffness = reduced * swings * swings;
  shaft.damping = 2 * 0.05 * reduced * swings;
}

TrueValues compliant(Bench& bench, BenchKind kind, double size, Draw draw) {
  make_compliant(bench, pick(kind, 5, 30) / std::sqrt(size), draw.within(0.3, 0.6));
  const auto& shaft = bench.plant.shaft;
  return {{"k", shaft.stiffness}, {"d", shaft.damping}, {"J_2", shaft.J_2}};
}

TrueValues backlash(Bench& bench, BenchKind, double size, Draw) {
  bench.plant.shaft.gap = 0.15 * size;
  return {{"gap", bench.plant.shaft.gap}};
}

// Load

TrueValues weight(Bench& bench, BenchKind kind, double size, Draw draw) {
  bench.plant.load.torque = (kind == BenchKind::slow ? 1 : draw.sign()) * pick(kind, 0.08, 0.012) * size;
  return {{"T_L", bench.plant.load.torque}};
}

TrueValues off_centre(Bench& bench, BenchKind kind, double size, Draw draw) {
  bench.plant.load.eccentric = pick(kind, 0.06, 0.0035) * size;
  bench.plant.load.eccentric_phase = draw.phase();
  return {{"T_e", bench.plant.load.eccentric}};
}

TrueValues spring_holds(Bench& bench, BenchKind kind, double size, Draw) {
  bench.plant.load.spring = pick(kind, 1, 0.15) * size;  // [N m/rad] a turn or less at what stalls the motor
  return {{"k", bench.plant.load.spring}};
}

TrueValues eddy_currents(Bench& bench, BenchKind kind, double size, Draw draw) {
  auto& load = bench.plant.load;
  load.eddy_torque = pick(kind, 0.06, 0.015) * size;
  load.eddy_omega = pick(kind, 60, 200) * draw.within(0.7, 1.3);
  if (!usual(bench)) load.eddy_heating = 3e-4;
  return {{"T_b", load.eddy_torque}, {"omega_b", load.eddy_omega}};
}

// Sensors

TrueValues tacho_lags(Bench& bench, BenchKind kind, double size, Draw) {
  bench.plant.sensors.tacho_lag = pick(kind, 0.035, 0.007) * size;
  return {{"tau", bench.plant.sensors.tacho_lag}};
}

TrueValues tacho_ripples(Bench& bench, BenchKind, double size, Draw draw) {
  auto& sensors = bench.plant.sensors;
  sensors.ripple = 0.012 * size;
  sensors.ripple_order = draw.one_of({1, 2, 2, 4, 6});
  sensors.ripple_phase = draw.phase();
  if (!usual(bench)) sensors.ripple_second = 0.2;
  return {{"r", sensors.ripple}};
}

TrueValues tacho_reads_high(Bench& bench, BenchKind kind, double size, Draw draw) {
  const double offset = draw.sign() * pick(kind, 0.8, 1.5) * size;
  if (auto* omega = channel(bench, Signal::omega)) omega->offset = offset;
  return {{"omega_0", offset}};
}

TrueValues gauge_lags(Bench& bench, BenchKind, double size, Draw) {
  bench.plant.sensors.torque_lag = 0.016 * size;
  return {{"tau", bench.plant.sensors.torque_lag}};
}

TrueValues gauge_reads_high(Bench& bench, BenchKind, double size, Draw draw) {
  const double offset = draw.sign() * 0.015 * size;
  if (auto* torque = channel(bench, Signal::torque)) torque->offset = offset;
  return {{"T_0", offset}};
}

TrueValues current_reads_high(Bench& bench, BenchKind kind, double size, Draw draw) {
  const double offset = draw.sign() * pick(kind, 0.02, 0.05) * size;
  if (auto* current = channel(bench, Signal::i_a)) current->offset = offset;
  bench.meter.offset = offset;
  return {{"i_0", offset}};
}

// Outside of any library

/// A bearing whose friction has a hump at one speed.
TrueValues friction_bump(Bench& bench, BenchKind kind, double size, Draw draw) {
  const double top = pick(kind, 0.03, 0.006) * size;
  const double at = pick(kind, draw.within(60, 110), draw.within(150, 320)), width = at * draw.within(0.08, 0.15);
  bench.plant.hidden_torque = [=](double omega, double, double) {
    const double x = (std::abs(omega) - at) / width;
    return std::copysign(top * std::exp(-x * x), omega);
  };
  return {};
}

/// A shaft that rubs over a part of each turn.
TrueValues sector_friction(Bench& bench, BenchKind kind, double size, Draw draw) {
  const double torque = pick(kind, 0.06, 0.006) * size, from = draw.phase(), part = draw.within(0.15, 0.3);
  bench.plant.hidden_torque = [=](double omega, double theta, double) {
    const double turn = (theta - from) / 6.283185307179586;
    return turn - std::floor(turn) < part ? torque * std::tanh(omega) : 0;
  };
  return {};
}

/// A neighbour's machine shakes the bench at 7 Hz.
TrueValues shaking(Bench& bench, BenchKind kind, double size, Draw draw) {
  const double torque = pick(kind, 0.1, 0.012) * size, phase = draw.phase();
  bench.plant.hidden_torque = [=](double, double, double t) {
    return torque * std::sin(6.283185307179586 * 7 * t + phase);
  };
  return {};
}

/// Iron that remembers the current.
TrueValues flux_hysteresis(Bench& bench, BenchKind kind, double size, Draw draw) {
  bench.plant.motor.flux_hysteresis = std::min(0.04 * size, 0.4);
  bench.plant.motor.coercive_current = pick(kind, 0.06, 0.8) * draw.within(0.7, 1.4);
  return {};
}

/// A tacho whose coupling sticks, then slips.
TrueValues tacho_coupling(Bench& bench, BenchKind kind, double size, Draw) {
  bench.plant.sensors.tacho_stick = pick(kind, 1.5, 4) * size;
  return {};
}

/// Brushes that lift at speed.
TrueValues brush_bounce(Bench& bench, BenchKind kind, double size, Draw draw) {
  const double more = pick(kind, 8, 0.3) * size;  // [ohm]
  const double at = pick(kind, draw.within(70, 120), draw.within(150, 300)), width = 0.05 * at;
  bench.plant.hidden_drop = [=](double i, double omega, double) {
    return more * i / (1 + std::exp(-(std::abs(omega) - at) / width));
  };
  return {};
}

/// A worn potentiometer in front of the driver: lost motion, as backlash is.
TrueValues reference_play(Bench& bench, BenchKind, double size, Draw) {
  bench.plant.driver.play = 0.05 * size;
  return {};
}

constexpr std::array all{
    Hidden{.id = "coulomb_friction", .hide = coulomb},
    Hidden{.id = "driver_dead_zone", .hide = dead_zone},
    Hidden{.id = "armature_inductance", .hide = inductance},
    Hidden{.id = "windage", .hide = blows},
    Hidden{.id = "load_torque", .hide = weight},
    Hidden{.id = "tacho_ripple", .hide = tacho_ripples},
    Hidden{.id = "brush_drop", .hide = brushes},
    Hidden{.id = "driver_delay", .hide = driver_delay},
    Hidden{.id = "armature_heating", .given = "eddy_brake", .largest = 10, .hide = heats},
    Hidden{.id = "stribeck_friction", .given = "coulomb_friction", .hide = stribeck_friction},
    Hidden{.id = "tacho_lag", .hide = tacho_lags},
    Hidden{.id = "driver_saturation", .hide = saturates},
    Hidden{.id = "driver_gain_error", .needs_voltage = true, .hide = gain_error},
    Hidden{.id = "driver_slew", .hide = slew},
    Hidden{.id = "driver_output_resistance", .needs_voltage = true, .hide = output_resistance},
    Hidden{.id = "driver_lag", .hide = driver_lag},
    Hidden{.id = "one_quadrant_driver", .fast = false, .sized = false, .hide = one_quadrant},
    Hidden{.id = "discontinuous_conduction", .fast = false, .hide = conduction},
    Hidden{.id = "armature_reaction", .given = "eddy_brake", .largest = 4.5, .hide = armature_reaction},
    Hidden{.id = "field_heating", .hide = field_heats},
    Hidden{.id = "asymmetric_friction", .slow = false, .given = "coulomb_friction", .largest = 1.8, .hide = asymmetric},
    Hidden{.id = "friction_warmup", .given = "coulomb_friction", .largest = 2, .hide = grease_warms},
    Hidden{.id = "cogging", .hide = cogs},
    Hidden{.id = "shaft_compliance", .largest = 10, .hide = compliant},
    Hidden{.id = "backlash", .slow = false, .given = "shaft_compliance", .hide = backlash},
    Hidden{.id = "eccentric_load", .hide = off_centre},
    Hidden{.id = "spring_load", .hide = spring_holds},
    Hidden{.id = "eddy_brake", .hide = eddy_currents},
    Hidden{.id = "tacho_offset", .hide = tacho_reads_high},
    Hidden{.id = "torque_lag", .slow = false, .given = "eddy_brake", .needs_gauge = true, .hide = gauge_lags},
    Hidden{.id = "torque_offset", .needs_gauge = true, .hide = gauge_reads_high},
    Hidden{.id = "current_offset", .hide = current_reads_high},
    Hidden{.id = "friction_bump", .outside = true, .hide = friction_bump},
    Hidden{.id = "sector_friction", .outside = true, .hide = sector_friction},
    Hidden{.id = "shaking", .outside = true, .hide = shaking},
    Hidden{.id = "flux_hysteresis", .outside = true, .hide = flux_hysteresis},
    Hidden{.id = "tacho_coupling", .outside = true, .hide = tacho_coupling},
    Hidden{.id = "brush_bounce", .outside = true, .hide = brush_bounce},
    Hidden{.id = "reference_play", .outside = true, .needs_voltage = true, .hide = reference_play},
};

}  // namespace

std::span<const Hidden> everything_hidden() { return all; }

const Hidden& hidden(std::string_view id) {
  const auto found = std::ranges::find(all, id, &Hidden::id);
  if (found == all.end()) throw std::out_of_range("nothing to hide is called " + std::string(id));
  return *found;
}

std::vector<std::string> right_answers(std::string_view truth, const Bench& bench, BenchKind kind) {
  std::vector<std::string> right{std::string(truth)};
  const auto measured = [&](Signal signal) {
    return std::ranges::find(bench.channels, signal, &simulated::DaqChannel::signal) != bench.channels.end();
  };
  const bool gauge = measured(Signal::torque);
  const bool one_way = kind == BenchKind::slow;
  const auto also = [&](std::string_view id) { right.emplace_back(id); };
  if (truth == "load_torque" && !gauge) {
    if (one_way) also("coulomb_friction");
    also("asymmetric_friction");
  }
  if (truth == "coulomb_friction" && !gauge && one_way) also("load_torque");
  if (truth == "coulomb_friction" && one_way) also("asymmetric_friction");
  if (truth == "asymmetric_friction") {
    if (!gauge) also("load_torque");
    if (one_way) also("coulomb_friction");
  }
  return right;
}

}  // namespace emtb::blind
