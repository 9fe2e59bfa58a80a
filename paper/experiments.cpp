#include "paper/experiments.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "analysis/estimate/acceleration.h"
#include "analysis/estimate/coast_down.h"
#include "analysis/estimate/driver_steps.h"
#include "analysis/estimate/electrical.h"
#include "analysis/estimate/switch_on.h"
#include "analysis/estimate/torque.h"
#include "paper/switch_on.h"

namespace emtb::paper {
namespace {

using simulated::Setup;

constexpr double gauge_gain = printed::K_m / printed::K_b;

// References that give some 110 V between the armature's terminals without load: the crests drive the motor.
constexpr double uncontrolled_reference = 4.2, controlled_reference = 1.7;  // [V]
constexpr double crest = 170;                                               // [V] of 120 V mains

std::span<const Run> one(const Run& run) { return {&run, 1}; }

KnownParameters truth(const simulated::PlantParameters& plant) {
  KnownParameters known;
  known.K_m = Quantity{"K_m", plant.motor.K_m, 0, "N m/A"};
  known.T_c = Quantity{"T_c", plant.friction.T_c, 0, "N m"};
  known.B = Quantity{"B", plant.motor.B, 0, "N m s/rad"};
  known.K_m_from = known.T_c_from = "the plant's";
  return known;
}

void electrical(Findings& f) {
  const Run run = raise_voltage(f.bench);
  const Settled settled = settled_points(one(run));
  f.equation_6 = estimate_equation_6(settled);
  f.armature = estimate_armature(settled);
  const Run coasting = open_armature(f.bench);
  f.generator = estimate_generator(one(coasting), settled_points(one(coasting)));
  f.friction = estimate_friction(settled, {.K_m = f.armature.at("K_b"), .K_m_from = "K_b"});
}

void brake(Findings& f) {
  const auto line = [](const Setup& setup) {
    const Run run = lower_voltage(setup, brake_of_figure_5());
    return estimate_load_line(settled_points(one(run)));
  };
  f.brake_line = line(f.bench);
  for (const double B : {0.0, 1e-4, 1e-3}) {
    Setup setup = f.bench;
    setup.plant.motor.B = B;
    f.brake_slope_against_B.emplace_back(B, line(setup).at("slope").value);
  }
  const Run run = turn_up_brake(f.bench);
  const Settled settled = settled_points(one(run));
  f.machine_line = estimate_load_line(settled);
  f.torque_constant = estimate_torque_constant(settled);
}

TorqueConstantCase torque_case(const std::string& name, const Setup& setup, double reference = printed::reference) {
  const Run run = turn_up_brake(setup, reference);
  const Settled settled = settled_points(one(run));
  const StaticEstimate line = estimate_torque_constant(settled), armature = estimate_armature(settled);
  TorqueConstantCase result{name, line.at("K_m").value, line.at("T_0").value, armature.at("R_a").value,
                            armature.at("K_b").value};
  if (setup.plant.driver.rectified > 0) {
    // Torque goes by the mean current: what the shaft takes and the motor loses says what it is.
    const auto form_factor = [&](const SettledPoint& p) {
      const auto& plant = setup.plant;
      const double omega = p.at(Signal::omega);
      const double mean = (p.at(Signal::torque) + plant.friction.T_c + plant.motor.B * omega) / plant.motor.K_m;
      return p.at(Signal::i_a) / mean;
    };
    result.form_factor_first = form_factor(settled.points.front());
    result.form_factor_last = form_factor(settled.points.back());
  }
  return result;
}

void torque_constants(Findings& f) {
  f.torque_constants.push_back(torque_case("the bench as it is", f.bench));
  Setup friction = f.bench;
  friction.plant.friction.T_c *= 2;
  f.torque_constants.push_back(torque_case("dry friction doubled", friction));
  friction = f.bench;
  friction.plant.motor.B *= 10;
  f.torque_constants.push_back(torque_case("viscous friction tenfold", friction));
  f.torque_constants.push_back(torque_case("torque gauge reads 0.745 of the torque", f.gauge));
  const auto pulses = [&](const std::string& name, double mains_crest, double L_a, double reference) {
    Setup setup = rectified(f.bench, mains_crest);
    setup.plant.motor.L_a = L_a;
    f.torque_constants.push_back(torque_case(name + ", rms meter", setup, reference));
  };
  pulses("full-wave rectifier", 0, 0, uncontrolled_reference);
  pulses("full-wave rectifier, L_a = 0.1 H", 0, 0.1, uncontrolled_reference);
  pulses("phase-controlled rectifier", crest, 0, controlled_reference);
  pulses("phase-controlled rectifier, L_a = 0.1 H", crest, 0.1, controlled_reference);
}

void inertia(Findings& f) {
  const KnownParameters known = truth(f.bench.plant);
  f.contactor = close_contactor(f.bench);
  f.slow_switch_on = estimate_switch_on(one(f.contactor), known);
  const Run fast = close_contactor(with_fast_ammeter(f.bench));
  f.fast_switch_on = estimate_switch_on(one(fast), known);
  const Run coasting = open_armature(f.bench);
  const StaticEstimate coast = estimate_coast_down(one(coasting), {.T_c = f.friction.at("T_c")});
  const std::vector<Run> moving{raise_voltage(f.bench), step_up_and_down(f.bench)};
  const StaticEstimate balance = estimate_acceleration(moving, {.K_m = f.armature.at("K_b")});
  const auto add = [&](const char* name, const Quantity& q) { f.inertias.push_back({name, q.value, q.std_error}); };
  add("switch-on, 0.4 s meter, as section 3.4", f.slow_switch_on.at("J"));
  add("switch-on, fast ammeter", f.fast_switch_on.at("J"));
  add("switch-on, fast ammeter, net of friction", f.fast_switch_on.at("J_net"));
  add("coast-down, T_c from settled points", coast.at("J"));
  add("acceleration, 0.4 s meter", balance.at("J"));
  const Parameter& p = f.with_friction_both.model.base[base::J];
  f.inertias.push_back({"fit to a rising and a falling step", p.value, p.std_error.value_or(0)});

  const SwitchOn driven(f.bench.plant);
  f.driver_acceleration = driven.peak_acceleration();
  f.driver_current = driven.peak_current();
  f.switch_ons.push_back({"behind the driver, 22.5 V/s", f.driver_current, f.driver_current, f.driver_acceleration});
  const auto cases = [&](const std::string& bench, const Setup& setup, double& window, double& slope,
                         double& inductance) {
    simulated::PlantParameters plant = past_the_driver(setup.plant);
    const SwitchOn hard(plant, 3);
    f.switch_ons.push_back(
        {bench + ": 110 V at once, ideal ammeter", hard.peak_current(), hard.peak_current(), hard.peak_acceleration()});
    const double averaged = setup.meter->window;
    double low = hard.peak_current(), high = 0;
    for (int phase = 0; phase < 40; ++phase) {
      const double reading = hard.largest_reading(averaged, phase / 40.0);
      low = std::min(low, reading);
      high = std::max(high, reading);
    }
    f.switch_ons.push_back({bench + ": 110 V at once, the bench's 0.4 s meter; slope over 0.4 s", low, high,
                            hard.mean_acceleration(averaged)});
    window = hard.window_for(printed::i_max);
    slope = hard.mean_acceleration(window);
    inductance = inductance_for(plant, printed::i_max);
    simulated::PlantParameters slow = plant;
    slow.motor.L_a = inductance;
    const SwitchOn inductive(slow, 3);
    f.switch_ons.push_back({bench + ": L_a so large that the peak is 1.73 A", inductive.peak_current(),
                            inductive.peak_current(), inductive.peak_acceleration()});
    plant.driver.output_resistance = plant.motor.R_a;
    const SwitchOn resisted(plant, 3);
    f.switch_ons.push_back({bench + ": a starting resistor as large as R_a", resisted.peak_current(),
                            resisted.peak_current(), resisted.peak_acceleration()});
  };
  cases("bench as shipped", f.bench, f.window_shipped, f.acceleration_shipped, f.inductance_shipped);
  cases("gauge 0.745", f.gauge, f.window_gauge, f.acceleration_gauge, f.inductance_gauge);
}

void driver(Findings& f) {
  f.driver_runs = driver_steps(f.bench);
  f.driver_gain = estimate_driver_gain(settled_points(f.driver_runs));
  f.driver_slopes = estimate_driver_slopes(f.driver_runs);
}

Model estimated(const Setup& setup) {
  const auto& m = setup.plant.motor;
  return linear_model(m.R_a, m.K_b, m.K_m, m.B, m.J);
}

const std::vector<Range> B_and_J{{"B", 0, 0.01}, {"J", 2e-4, 0.1}};

void calibrations(Findings& f) {
  const Model start = estimated(f.bench);
  f.rising = step_up(f.bench);
  f.both = step_up_and_down(f.bench);
  f.both_parameters = fit("rising step", {f.rising}, speed_only, freed(start, B_and_J));
  f.only_inertia = fit("rising step, J alone", {f.rising}, speed_only, freed(start, {B_and_J[1]}));
  f.with_falling_step = fit("rising and falling step", {f.both}, speed_only, freed(start, B_and_J));
  std::vector<Range> three = B_and_J;
  three.push_back({"coulomb_friction.T_c", 0, 1});
  const Model dry = freed(with_friction(start, 0.01), three);
  f.with_friction_rising = fit("rising step, with T_c", {f.rising}, speed_only, dry);
  f.with_friction_both = fit("rising and falling step, with T_c", {f.both}, speed_only, dry);

  // The bench with the gauge of 0.745, in the gauge's units: the model that the paper had.
  const Model in_gauge_units = linear_model(printed::R_a, printed::K_b, printed::K_m, printed::B, printed::J);
  const auto fitted = [&](double T_c, double B) {
    Setup setup = f.gauge;
    setup.plant.friction.T_c = T_c / gauge_gain;
    setup.plant.motor.B = B / gauge_gain;
    return fit("gauge 0.745, rising step", {step_up(setup)}, speed_only, freed(in_gauge_units, B_and_J));
  };
  f.gauge_rising = fitted(printed::T_0, printed::B);
  const OutputErrorFit printed_fit{
      .name = "table 1, calibrated",
      .model = linear_model(printed::R_a_calibrated, printed::K_b_calibrated, printed::K_m_calibrated,
                            printed::B_calibrated, printed::J_calibrated)};
  f.printed_gain = printed_fit.gain();
  f.printed_time_constant = printed_fit.time_constant();
  f.printed_B = (1 / f.printed_gain - printed::K_b) * printed::K_m / printed::R_a;
  f.printed_J = f.printed_time_constant * (printed::K_m * printed::K_b + printed::R_a * f.printed_B) / printed::R_a;
  // Newton's method in two unknowns: which T_c and B of the plant make the fit give these?
  double T_c = printed::T_0, B = printed::B;
  for (int n = 0; n < 4; ++n) {
    constexpr double dT = 5e-3, dB = 5e-5;
    const OutputErrorFit here = fitted(T_c, B), along_T = fitted(T_c + dT, B), along_B = fitted(T_c, B + dB);
    const double b_T = (along_T.at("B") - here.at("B")) / dT, b_B = (along_B.at("B") - here.at("B")) / dB;
    const double j_T = (along_T.at("J") - here.at("J")) / dT, j_B = (along_B.at("J") - here.at("J")) / dB;
    const double b = f.printed_B - here.at("B"), j = f.printed_J - here.at("J"), all = b_T * j_B - b_B * j_T;
    T_c = std::max(0.0, T_c + (b * j_B - b_B * j) / all);
    B = std::max(0.0, B + (b_T * j - b * j_T) / all);
  }
  f.needed_T_c = T_c;
  f.needed_B = B;
}

void identifiability(Findings& f) {
  const Model start = estimated(f.bench);
  const std::vector<Range> bounds{
      {"R_a", 27, 35}, {"K_b", 0.6, 0.75}, {"K_m", 0.6, 0.75}, {"B", 0, 2e-3}, {"J", 2e-3, 8e-3}};
  const std::vector<Range> none{{"R_a", -1e3, 1e3}, {"K_b", -10, 10}, {"K_m", -10, 10}, {"B", -1, 1}, {"J", -10, 10}};
  using Start = std::map<std::string, double>;
  for (const Start& from :
       {Start{}, Start{{"R_a", 28}, {"J", 6e-3}}, Start{{"R_a", 34}, {"K_b", 0.64}, {"K_m", 0.7}}}) {
    f.starts.push_back(fit("", {f.rising}, speed_only, starting_from(freed(start, bounds), from)));
  }
  for (const Start& from : {Start{{"R_a", 100}}, Start{{"R_a", -30}, {"K_m", -0.6}},
                            Start{{"K_m", -0.6}, {"B", -1e-4}, {"J", -4e-3}}, Start{{"J", 1}}}) {
    f.unbounded.push_back(fit("", {f.rising}, speed_only, starting_from(freed(start, none), from)));
  }
  const Model free =
      freed(start, {{"R_a", 5, 100}, {"K_b", 0.1, 2}, {"K_m", 0.1, 2}, {"B", 0, 0.01}, {"J", 2e-4, 0.1}});
  const Run braked = turn_up_brake(f.bench);
  f.identifiability.push_back({"speed of a rising step", fit("", {f.rising}, speed_only, free)});
  f.identifiability.push_back({"speed of a rising and a falling step", fit("", {f.both}, speed_only, free)});
  f.identifiability.push_back(
      {"the same, e_a, and the current by the slow meter", fit("", {f.both}, speed_and_current, free)});
  f.identifiability.push_back(
      {"the same, and a run with a brake and the torque gauge", fit("", {f.both, braked}, with_torque, free)});
}

}  // namespace

Findings find(const std::function<void(double, const std::string&)>& progress) {
  Findings f;
  f.bench = fh2();
  f.gauge = with_gauge_gain(f.bench, gauge_gain);
  const std::array<std::pair<const char*, void (*)(Findings&)>, 7> steps{{{"resistance and back-EMF", electrical},
                                                                          {"brake", brake},
                                                                          {"torque constant", torque_constants},
                                                                          {"calibrations", calibrations},
                                                                          {"inertia", inertia},
                                                                          {"driver", driver},
                                                                          {"identifiability", identifiability}}};
  for (std::size_t n = 0; n < steps.size(); ++n) {
    if (progress) progress(static_cast<double>(n) / static_cast<double>(steps.size()), steps[n].first);
    steps[n].second(f);
  }
  return f;
}

}  // namespace emtb::paper
