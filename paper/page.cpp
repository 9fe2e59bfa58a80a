#include "paper/page.h"

#include <algorithm>
#include <cmath>
#include <fstream>

#include "hal/error.h"
#include "paper/switch_on.h"
#include "paper/text.h"
#include "session/spec.h"

namespace emtb::paper {
namespace {

std::string both(const Quantity& q) { return with_error(q.value, q.std_error); }

std::string parameter(const OutputErrorFit& fit, const std::string& name, int digits = 3) {
  return number(fit.at(name), digits);
}

/// A singular value: what is below a hundredth of the noise is nothing.
std::string singular(double value) { return value < 0.01 ? "0" : number(value, value < 1 ? 1 : 2); }

struct Writer {
  const Findings& f;
  Markdown md = {};

  void introduction() {
    md.heading(1, "The paper, again");
    md.say(
        "Erdal, Doğan and Buldu, \"Realtime parameter estimation, calibration and simulation of a DC motor\", 2011, "
        "identified a DC motor: five parameters by experiment (section 3), then a fit to the speed of one run (section "
        "4). The fit moved the friction B by +800 % and the inertia J by +45 %. This page repeats each experiment on a "
        "simulated copy of the bench, sets the numbers side by side, and says for each difference where it comes "
        "from.");
    md.say(
        "All numbers and pictures on it are written by one command, `emtb paper --out docs`, in a few seconds and "
        "without hardware. The simulated motor is known to the last digit, so each method can be judged. It lives in "
        "`config/benches/fh2-simulated.yaml` and shares no equation with the models that are fitted to it. Its meter "
        "averages the current over {} s, as a bench multimeter does. ± is one standard error.",
        {number(f.bench.meter->window)});
    const auto& m = f.bench.plant.motor;
    md.table(
        {{"", "printed", "same experiment, simulated", "true there", "unit"},
         {"R_a, figure 4", "31.825", both(f.equation_6.at("R_a")), number(m.R_a, 5), "Ω"},
         {"K_b, figure 4", "0.6739", both(f.equation_6.at("K_b")), number(m.K_b), "V s/rad"},
         {"K_b as a generator", "0.7182", both(f.generator.at("K_b")), number(m.K_b), "V s/rad"},
         {"B, figure 5", "0.0001", both(f.brake_line.at("slope")), "not measured by it", "N m s/rad"},
         {"T_L, figure 5", "0.0865", both(f.brake_line.at("intercept")), "the brake's", "N m"},
         {"K_m, figure 6", "0.5024", both(f.torque_constant.at("K_m")), number(m.K_m), "N m/A"},
         {"no-load loss, figure 6", "0.0547", both(f.torque_constant.at("T_0")), number(loss_without_load()), "N m"},
         {"J, section 3.4", "0.003449", both(f.slow_switch_on.at("J")) + ", see below", number(m.J), "kg m²"},
         {"rise, figure 8", "22.5", both(f.driver_slopes.at("rise")), number(f.bench.plant.driver.rise), "V/s"},
         {"fall, figure 8", "-20.4", both(f.driver_slopes.at("fall")), number(-f.bench.plant.driver.fall), "V/s"},
         {"driver gain", "110/6", both(f.driver_gain.at("gain")), number(f.bench.plant.driver.gain, 5), "V/V"}});
    md.say("In short:");
    md.bullet(
        "Figure 5 measures the brake, not the motor's friction. Figure 6 does measure that friction, as an intercept, "
        "and the paper's linear model has no place for it.");
    md.bullet(
        "That missing friction alone moves a fitted B by {} and J by {}. With a falling step in the data J moves by "
        "{}. With the friction in the model J moves by {}.",
        {change(m.B, f.both_parameters.at("B")), change(m.J, f.both_parameters.at("J")),
         change(m.J, f.with_falling_step.at("J"), 2), change(m.J, f.with_friction_both.at("J"), 1)});
    md.bullet(
        "The speed of a linear motor fixes two numbers. The paper fitted five: three of them stay where the start and "
        "the bounds put them.");
    md.bullet(
        "K_m should equal K_b. The printed ratio is {}: a torque gauge that reads too little explains all of it, "
        "friction none of it.",
        {number(printed::K_m / printed::K_b, 3)});
    md.bullet("The 268 rad/s² of section 3.4 cannot come through the driver, which allows {} rad/s².",
              {number(f.driver_acceleration, 3)});
  }

  /// [N m] friction at the speed that 110 V would give without any current.
  double loss_without_load() const {
    const auto& p = f.bench.plant;
    return p.friction.T_c + p.motor.B * printed::voltage / p.motor.K_b;
  }

  void section_3_1() {
    md.heading(2, "3.1 R_a and K_b: figure 4");
    md.picture("figure_4", "e_a/i_a against ω/i_a: twelve settled points on one line");
    const std::vector<double>&x = f.equation_6.series.front().x, &y = f.equation_6.series.front().y;
    std::vector<LinePoint> plain;
    for (std::size_t k = 0; k < x.size(); ++k) plain.push_back({.x = x[k], .y = y[k]});
    const LineFit line = fit_line(plain);
    md.say(
        "The voltage is raised in {} steps without load; each point is a mean over a settled stretch. Equation (6) "
        "divides by the current, which is only about 0.1 A here, so a meter step of {} A moves a point by 1 %. It "
        "moves x and y together, along a line that nearly passes through the point itself, and that saves the method: "
        "the fit with errors in both gives R_a = {} Ω, plain least squares {} Ω, and the equation without the "
        "division, e_a = R_a i_a + K_b ω, {} Ω.",
        {std::to_string(f.equation_6.points), number(f.bench.meter->resolution), both(f.equation_6.at("R_a")),
         with_error(line.intercept, line.intercept_error), both(f.armature.at("R_a"))});
    const double stronger = printed::K_b_generator / printed::K_b;
    md.say(
        "The paper finds K_b = 0.7182 with the machine as a generator, {} more than 0.6739. On the simulated bench "
        "both tests agree ({} and {}): the method is not to blame. A field that was stronger by that much is one "
        "explanation. It has a companion: section 3.4 multiplies by 0.5349 where K_m is 0.5024, which is {} more, and "
        "0.5349/0.7182 = {} is 0.5024/0.6739 = {}. So 0.5349 may be no misprint but the K_m that belongs to the "
        "generator test, measured with the same field. Copper gains 0.393 % a kelvin: a field winding {} K warmer "
        "carries that much less current. The paper does not say.",
        {change(1, stronger, 2), both(f.equation_6.at("K_b")), both(f.generator.at("K_b")),
         change(printed::K_m, printed::K_m_of_product, 2), number(printed::K_m_of_product / printed::K_b_generator, 3),
         number(printed::K_m / printed::K_b, 3), number((stronger - 1) / 0.00393, 2)});
  }

  void section_3_2() {
    md.heading(2, "3.2 B: figure 5 measures the brake");
    md.picture("figure_5", "Gauge torque against speed for one setting of the brake");
    const auto& m = f.bench.plant.motor;
    md.say(
        "The gauge sits between motor and load: it reads what the brake takes. The motor's own friction never reaches "
        "it. The simulated brake (an eddy-current brake, set once to 0.1 N m at 110 V) was so chosen that the line is "
        "the paper's: {} ω + {} N m. A motor without any viscous friction gives the same line, and one with ten times "
        "more does not give ten times more:",
        {number(f.brake_line.at("slope").value, 2), number(f.brake_line.at("intercept").value, 3)});
    std::vector<std::vector<std::string>> rows{
        {"B of the simulated motor [N m s/rad]", "slope of figure 5 [N m s/rad]"}};
    for (const auto& [B, slope] : f.brake_slope_against_B) {
      rows.push_back({number(B), with_error(slope, f.brake_line.at("slope").std_error)});
    }
    md.table(rows);
    md.say("(± is large because the curve of the brake bends; with B the speeds shift along it.)");
    md.say(
        "Nor was the brake varied at one voltage. Then the points lie on the machine's own speed-torque line, whose "
        "slope is -(K_m K_b/R_a + B) = {} N m s/rad; the simulated experiment gives {}. The printed slope is positive "
        "and {} times smaller: the voltage was lowered at one setting of the brake.",
        {number(-(m.K_m * m.K_b / m.R_a + m.B)), both(f.machine_line.at("slope")),
         number(std::abs(f.machine_line.at("slope").value) / printed::B, 3)});
    md.say(
        "The motor's friction is what the current makes and the gauge does not see: K_m i_a - torque = B ω + T_c. From "
        "the points of figure 4: B = {} N m s/rad (true {}), T_c = {} N m (true {}).",
        {both(f.friction.at("B")), number(m.B), both(f.friction.at("T_c")), number(f.bench.plant.friction.T_c)});
  }

  void section_3_3() {
    md.heading(2, "3.3 K_m and the no-load loss: figure 6");
    md.picture("figure_6", "Gauge torque against current, the brake turned up at 110 V");
    const auto& p = f.bench.plant;
    md.say(
        "The line is torque = (K_m + B R_a/K_b) i_a - (T_c + B e_a/K_b): the slope is K_m, a little too large ({} "
        "expected, {} found), and the intercept is the whole no-load loss at the speed where no current would flow ({} "
        "expected, {} found). The paper prints -0.0547 N m and drops it. If B is 0.0001, {} N m of it grow with speed "
        "and {} N m are dry friction. The simulated bench has the whole 0.0547 N m as dry friction.",
        {number(p.motor.K_m + p.motor.B * p.motor.R_a / p.motor.K_b), both(f.torque_constant.at("K_m")),
         number(loss_without_load(), 3), both(f.torque_constant.at("T_0")),
         number(printed::B * printed::voltage / printed::K_b, 3),
         number(printed::T_0 - printed::B * printed::voltage / printed::K_b, 3)});
  }

  void torque_constant() {
    md.heading(2, "Why K_m is not K_b");
    md.say(
        "In SI units K_m = K_b, because electrical power K_b ω i_a becomes mechanical power K_m i_a ω. The printed "
        "ratio is {}. What could make figure 6's slope that small? Each suspect was put into the simulated bench:",
        {number(printed::K_m / printed::K_b, 3)});
    std::vector<std::vector<std::string>> rows{{"bench", "K_m by figure 6 [N m/A]", "K_m/K_b true", "intercept [N m]",
                                                "R_a by the same points [Ω]", "rms/mean of i_a, no load to full"}};
    for (const TorqueConstantCase& c : f.torque_constants) {
      const bool pulses = c.form_factor_first > 1;
      rows.push_back({c.name, number(c.K_m), number(c.K_m / f.bench.plant.motor.K_b, 3), number(-c.T_0, 3),
                      number(c.R_a),
                      pulses ? number(c.form_factor_first, 3) + " to " + number(c.form_factor_last, 3) : "1"});
    }
    md.table(rows);
    const double form_factor = printed::K_b / printed::K_m;
    double lowest = printed::R_a, highest = 0;
    for (const TorqueConstantCase& c : f.torque_constants) {
      if (c.form_factor_first == 1) continue;
      lowest = std::min(lowest, c.R_a);
      highest = std::max(highest, c.R_a);
    }
    md.bullet("Friction cannot do it. It shifts the line; where it grows with speed it makes the slope larger.");
    md.bullet(
        "A gauge that reads 0.745 of the torque does, and leaves R_a and K_b alone. Then every torque of the paper, J "
        "and B included, is in that gauge's units: the real ones are {} times larger.",
        {number(form_factor, 3)});
    const auto ratio = [&](std::size_t n) { return number(f.torque_constants[n].K_m / f.bench.plant.motor.K_b, 2); };
    md.bullet(
        "A pulsating current, read by an rms meter, makes the slope smaller too: torque goes by the mean. The "
        "rectifiers "
        "tried give {}, {}, {} and {} of K_b, so 0.745 could be had. But the same current spoils R_a: it comes out as "
        "{} to {} Ω "
        "where 31.825 is true. For a constant rms/mean of {} the true R_a would have to be {} Ω to be read as the "
        "paper's 31.825, "
        "while its ohmmeter showed about 30.",
        {ratio(4), ratio(5), ratio(6), ratio(7), number(lowest, 3), number(highest, 3), number(form_factor, 3),
         number(printed::R_a * form_factor, 3)});
    md.bullet(
        "0.5349/0.7182 is {} as well (see 3.1): the same factor at another field. A gauge would keep it; a form factor "
        "depends on the current.",
        {number(printed::K_m_of_product / printed::K_b_generator, 3)});
    md.say(
        "So the gauge's gain is the likelier explanation. That is a judgement: the paper has no data to decide it. A "
        "known weight on a lever would.");
  }

  void section_3_4() {
    md.heading(2, "3.4 J: 1.73 A and 268 rad/s²");
    md.picture("figure_7", "Speed and current after a switch-on past the driver and behind it");
    md.say(
        "Behind the driver the voltage rises at 22.5 V/s. The motor follows it, and cannot accelerate faster than "
        "22.5/K_b = {} rad/s². Simulated: {} rad/s² at most, and {} A. The printed 268.29 rad/s² and 1.73 A need the "
        "voltage at once, past the driver: a contactor. `emtb estimate --what inertia` refuses a run behind the driver "
        "for that reason.",
        {number(printed::rise / printed::K_b, 3), number(f.driver_acceleration, 3), number(f.driver_current, 2)});
    md.say("But 110 V across 31.825 Ω give {} A, twice as much. What can make it 1.73 A?",
           {number(printed::voltage / printed::R_a)});
    std::vector<std::vector<std::string>> rows{{"start", "largest current [A]", "acceleration [rad/s²]"}};
    for (const SwitchOnCase& c : f.switch_ons) {
      const bool range = c.current_high - c.current_low > 1e-3;
      rows.push_back({c.name,
                      range ? number(c.current_low, 3) + " to " + number(c.current_high, 3) : number(c.current_high, 3),
                      number(c.acceleration, 3)});
    }
    rows.push_back({"**printed**", "**1.73**", "**268.29**"});
    md.table(rows);
    md.say(
        "\"Gauge 0.745\" is the bench of the section before, with J larger by {}: its accelerations are smaller. The "
        "meter's reading depends on when in its 0.4 s the contactor closes, hence the ranges.",
        {number(printed::K_b / printed::K_m, 3)});
    what_halves_the_current();
    inertia_by_six_methods();
  }

  /// Causes of a current of 1.73 A that can be held against the other numbers.
  void what_halves_the_current() {
    const double torque = printed::K_m * printed::i_max;
    const auto& g = f.gauge.plant;
    const double mean_speed = f.acceleration_gauge * f.window_gauge / 2;
    const double J = (torque - printed::T_0 - printed::B * mean_speed) / f.acceleration_gauge;
    md.bullet(
        "A meter that averages. The paper's was a multimeter on a serial line. The mean current from the switch-on on "
        "is 1.73 A over {} s (bench as shipped) or {} s (gauge 0.745), and the mean slope over the same time is {} or "
        "{} rad/s²; the printed 268 lies between. Mean current and mean slope over the same time still give the right "
        "J: ({} · 1.73 - friction)/{} = {} kg m² in the gauge's units, where {} is true.",
        {number(f.window_shipped, 2), number(f.window_gauge, 2), number(f.acceleration_shipped, 3),
         number(f.acceleration_gauge, 3), number(printed::K_m), number(f.acceleration_gauge, 3), number(J, 3),
         number(g.motor.J * printed::K_m / printed::K_b)});
    md.bullet(
        "Twice the resistance, or half the voltage: 110/(2 · 31.825) = {} A is the printed current to three digits. A "
        "starting resistor as large as R_a would do that. Nothing in the paper speaks of one.",
        {number(printed::voltage / printed::R_a / 2)});
    md.bullet(
        "Inductance. It would take {} to {} H, a time constant L_a/R_a of {} to {} s. The paper neglects L_a; with "
        "that it could not.",
        {number(f.inductance_shipped, 3), number(f.inductance_gauge, 3), number(f.inductance_shipped / printed::R_a, 2),
         number(f.inductance_gauge / printed::R_a, 2)});
    md.say(
        "Which of the first two it was, the paper does not tell, nor whether there was a contactor at all. A meter "
        "with about two readings a second is the simplest: multimeters on a serial line are such meters. The paper's "
        "product uses 0.5349 for K_m (see 3.1): with 0.5024 J would be {} instead of 0.003449 ({}), and {} net of the "
        "printed no-load loss.",
        {number(torque / printed::acceleration), change(printed::J, torque / printed::acceleration, 2),
         number((torque - printed::T_0) / printed::acceleration)});
  }

  void inertia_by_six_methods() {
    md.picture("inertia", "J by six methods with two standard errors");
    std::vector<std::vector<std::string>> methods{{"method", "J [kg m²]", "off by"}};
    for (const InertiaCase& c : f.inertias) {
      methods.push_back({c.name, with_error(c.J, c.std_error), change(f.bench.plant.motor.J, c.J, 2)});
    }
    md.table(methods);
    md.say(
        "The slow meter halves the peak and J with it: here the slope is that of the first instant, so nothing makes "
        "up for it. Methods that balance torque and acceleration over the meter's own windows, or that open the "
        "armature and need no current at all, give J to about a per cent.");
  }

  void section_4() {
    md.heading(2, "4 The driver: figure 8");
    md.picture("figure_8", "Driver voltage after three steps");
    md.say(
        "Lines through each transition give {} V/s up and {} V/s down, from {} transitions; settled points give a gain "
        "of {} V/V and an offset of {} V. The slopes do not depend on the size of the step, and the transitions are "
        "straight: a limit of slope, not a lag.",
        {both(f.driver_slopes.at("rise")), both(f.driver_slopes.at("fall")), std::to_string(f.driver_slopes.points),
         both(f.driver_gain.at("gain")), both(f.driver_gain.at("offset"))});
  }

  void table_1() {
    const auto& m = f.bench.plant.motor;
    md.heading(2, "Table 1: why B moved by +800 % and J by +45 %");
    md.picture("figure_11", "Measured speed of a rising and a falling step, three models and their residuals");
    md.say(
        "The paper's calibrated model was fitted to the speed of a rising step. Here the same is done to the simulated "
        "bench, whose dry friction of {} N m the linear model lacks. The electrical constants are known; B and J are "
        "fitted. The error is in units of the noise: 1 is a perfect model.",
        {number(f.bench.plant.friction.T_c)});
    std::vector<std::vector<std::string>> rows{
        {"fit", "B [N m s/rad]", "change", "J [kg m²]", "change", "T_c [N m]", "error"}};
    for (const OutputErrorFit* fit :
         {&f.both_parameters, &f.only_inertia, &f.with_falling_step, &f.with_friction_rising, &f.with_friction_both}) {
      const bool dry = fit == &f.with_friction_rising || fit == &f.with_friction_both;
      rows.push_back({fit->name, parameter(*fit, "B"), fit == &f.only_inertia ? "(fixed)" : change(m.B, fit->at("B")),
                      parameter(*fit, "J", 4), change(m.J, fit->at("J")),
                      dry ? parameter(*fit, "coulomb_friction.T_c", 4) : "none", number(fit->error, 3)});
    }
    rows.push_back({"the paper's, figure 11", "0.0009", "+800 %", "0.0050", "+45 %", "none", ""});
    md.table(rows);
    md.bullet(
        "On a rising step friction always brakes. B takes what it costs in final speed, J what it costs in "
        "acceleration: a ramp of 33.4 rad/s² and a friction of 0.0547 N m look like {} kg m² more, if J has to bear it "
        "alone.",
        {number(printed::T_0 / (printed::rise / printed::K_b), 3)});
    md.bullet(
        "On the falling step friction helps to brake. Too large a J would coast for too long (the picture's shaded "
        "part), so with that step in the data J stays, and only B is wrong.");
    md.bullet("With T_c in the model both come back, from the same rising step, and the error falls to the noise.");
    const double final_speed = f.printed_gain * printed::voltage;
    const double loss = printed::K_m * (printed::voltage - printed::K_b * final_speed) / printed::R_a;
    md.say(
        "The printed changes are larger than these. What the paper's fit fixes are two numbers, the gain {} rad/(V s) "
        "and the time constant {} s of its calibrated column. At 110 V they mean {} rad/s, so the motor lost {} N m in "
        "that run (in the gauge's units), {} times the {} N m of figure 6. A motor with T_c = {} N m and B = {} N m "
        "s/rad would give Table 1's two numbers exactly, with J still 0.003449. So J's +45 % needs no more inertia, "
        "but it needs more friction than figure 6 shows: a cold machine, a brake that drags; or a driver that gave {} "
        "V instead of 110. The paper does not say.",
        {number(f.printed_gain), number(f.printed_time_constant, 3), number(final_speed), number(loss, 3),
         number(loss / printed::T_0, 2), number(printed::T_0, 3), number(f.needed_T_c, 2), number(f.needed_B, 2),
         number(printed::K_b * final_speed + printed::R_a * printed::T_0 / printed::K_m)});
    md.say(
        "On the bench with the gauge of 0.745, which shows the paper's K_m, the fit to a rising step moves B by {} and "
        "J by {}: whether K_m is 0.6739 or 0.5024 hardly matters here.",
        {change(printed::B, f.gauge_rising.at("B")), change(printed::J, f.gauge_rising.at("J"))});
  }

  void identifiability() {
    md.heading(2, "Five parameters from one speed");
    md.say(
        "Without inductance the linear motor is dω/dt = a e_a - b ω with a = K_m/(R_a J) and b = (K_m K_b/R_a + B)/J. "
        "The speed knows a and b, nothing else. The singular values of its sensitivities to relative changes of the "
        "five parameters say so (in units of the noise; the reciprocal is the relative error of a combination):");
    std::vector<std::vector<std::string>> rows{{"data", "singular values", "combinations fixed to 10 %"}};
    for (const IdentifiabilityCase& c : f.identifiability) {
      std::string values;
      for (const double s : c.fit.singular_values) values += (values.empty() ? "" : ", ") + singular(s);
      rows.push_back({c.data, values, std::to_string(c.fit.determined) + " of " + std::to_string(c.fit.free)});
    }
    md.table(rows);
    md.say(
        "The current adds two. The last is the common factor of K_m, B and J, which only a measured torque that varies "
        "can fix. The values of five fitted parameters therefore depend on where the fit began. Three fits within "
        "bounds, of the same rising step:");
    const auto listed = [](const std::vector<OutputErrorFit>& fits, const std::vector<std::string>& begins) {
      std::vector<std::vector<std::string>> table{{"start", "R_a [Ω]", "K_b", "K_m", "B", "J", "error"}};
      for (std::size_t n = 0; n < fits.size(); ++n) {
        std::vector<std::string> row{begins[n]};
        for (const char* name : {"R_a", "K_b", "K_m", "B", "J"}) row.push_back(parameter(fits[n], name));
        row.push_back(number(fits[n].error, 4));
        table.push_back(row);
      }
      return table;
    };
    md.table(listed(f.starts, {"the true values", "R_a = 28, J = 0.006", "R_a = 34, K_b = 0.64, K_m = 0.7"}));
    md.say("Equal errors, to the last digit shown, and J anywhere between {} and {} kg m².",
           {parameter(f.starts[2], "J"), parameter(f.starts[1], "J")});
    md.heading(2, "What the bounds did");
    md.say(
        "The paper reports that without bounds the tool finds \"insensible parameter values, like finding R_a or J "
        "negative\", and blames local minima. They are not local: R_a and K_m may change sign together, or K_m, B and "
        "J, without any change of a and b. Four starts between bounds so wide that they hardly matter (R_a ±1000 Ω, "
        "K_b, K_m and J ±10, B ±1):");
    md.table(listed(f.unbounded, {"R_a = 100", "R_a = -30, K_m = -0.6", "K_m, B, J negative", "J = 1"}));
    md.say(
        "The first three describe the speed exactly as well as the fits within bounds do. A start as poor as the last "
        "is the other failure: from there a search may lose its way, or find yet another of these. The paper's bounds "
        "on R_a, 27 to 35 Ω around an "
        "ohmmeter's 30 Ω, are no help for convergence: they are the measurement of R_a. emtb takes such knowledge as "
        "`prior: {value, std}` or `fixed`, and says what the data do not determine.");
  }

  void misprints() {
    md.heading(2, "Misprints");
    md.bullet(
        "R_a = 3.825 Ω (twice in the text) is 31.825 Ω, as in figure 4 and Table 1. An ohmmeter showed about 30 Ω.");
    md.bullet("K_b is in (rad/s)/V in section 3.1; it is V/(rad/s), as in Table 1.");
    md.bullet(
        "Section 3.4 multiplies by 0.5349 where K_m is 0.5024; see 3.1 for why this may be no misprint. 0.5349 · 1.73 "
        "= {}, and {}/268.29 = {}, as printed.",
        {number(printed::K_m_of_product * printed::i_max, 5), number(printed::K_m_of_product * printed::i_max, 5),
         number(printed::K_m_of_product * printed::i_max / printed::acceleration)});
  }

  void how() {
    md.heading(2, "By hand");
    md.say(
        "`emtb paper --out docs --sessions DIR` also writes the runs. The same code then answers, for these and for "
        "sessions of a real bench:");
    md.say(
        "```\nemtb estimate DIR/raise_voltage.csv --what resistance friction --svg DIR     # figures 4, and B and "
        "T_c\nemtb estimate DIR/lower_voltage.csv --what friction                          # figure 5\nemtb estimate "
        "DIR/turn_up_brake.csv --what torque-constant                   # figure 6\nemtb estimate "
        "DIR/close_contactor.csv DIR/raise_voltage.csv --what inertia   # section 3.4\nemtb estimate "
        "DIR/open_armature.csv DIR/raise_voltage.csv --what coast-down generator\nemtb estimate DIR/step_to_2_V.csv "
        "DIR/step_to_4_V.csv DIR/step_to_6_V.csv --what driver\n```");
    md.say(
        "Noise is seeded, so the page is the same each time; on another processor last digits may differ. A test "
        "compares this file with what the command writes.");
  }
};

void write(const std::filesystem::path& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary);
  out << text;
  if (!out.flush()) throw Error(file.string() + ": cannot be written. Give another --out DIR");
}

void make_folder(const std::filesystem::path& folder, const char* option) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    throw Error(folder.string() + ": cannot be made (" + error.message() + "). Give another " + option + " DIR");
  }
}

}  // namespace

std::string page(const Findings& findings) {
  Writer w{findings};
  w.introduction();
  w.section_3_1();
  w.section_3_2();
  w.section_3_3();
  w.torque_constant();
  w.section_3_4();
  w.section_4();
  w.table_1();
  w.identifiability();
  w.misprints();
  w.how();
  return w.md.text();
}

void write_page(const Findings& findings, const std::filesystem::path& folder) {
  make_folder(folder / "pictures" / "paper", "--out");
  for (const auto& [name, figure] : pictures(findings)) {
    write_svg(figure, folder / "pictures" / "paper" / (name + ".svg"));
  }
  write(folder / "paper.md", page(findings));
}

std::vector<std::filesystem::path> write_sessions(const Findings& findings, const std::filesystem::path& folder) {
  make_folder(folder, "--sessions");
  std::vector<Run> runs{raise_voltage(findings.bench),
                        lower_voltage(findings.bench, brake_of_figure_5()),
                        turn_up_brake(findings.bench),
                        findings.contactor,
                        open_armature(findings.bench),
                        findings.rising,
                        findings.both};
  runs.insert(runs.end(), findings.driver_runs.begin(), findings.driver_runs.end());
  std::vector<std::filesystem::path> files;
  for (const Run& run : runs) {
    std::string name = run.name;
    for (char& c : name) c = c == ' ' ? '_' : c;
    Session session;
    session.runs.push_back(run);
    files.push_back(folder / (name + ".csv"));
    write_session(files.back(), session);
  }
  return files;
}

}  // namespace emtb::paper
