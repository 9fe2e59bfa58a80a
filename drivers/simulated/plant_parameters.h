#pragma once

#include <functional>
#include <limits>

namespace emtb::simulated {

/// Where books and benches have several laws for one effect: which of them the plant obeys.
enum class Laws {
  usual,  ///< the equations of the books, which are the library's, too: for judging parameters and their intervals
  other,  ///< another plausible law of the same effect: a diagnosis that is judged on its own equations is not judged
};

/// How the plant's dry friction works. Neither law is the model's (a sign function with an implicit step).
enum class FrictionLaw {
  /// An elastic bristle that slips at its breakaway torque (Prandtl's element: LuGre's presliding with Dupont's
  /// elasto-plastic limit).
  /// Held at rest without drift, at the price of some 1e-4 rad of give.
  bristle,
  /// Stuck or sliding, with the moment of stopping located inside the step. No give at all.
  hard,
};

inline constexpr double unlimited = std::numeric_limits<double>::infinity();

/// u_ref -> e -> e_a
struct DriverParameters {
  double gain = 1;          ///< [V/V]
  double offset = 0;        ///< [V] of the output while the reference is above zero; other: fades in over 0.05 V
  double rise = unlimited;  ///< [V/s] de/dt <= rise
  double fall = unlimited;  ///< [V/s] -fall <= de/dt
  double min = -unlimited;  ///< [V]
  double max = unlimited;   ///< [V] other: with a knee, rounded over `knee`
  double knee = 0;          ///< [V] of output over which the limit sets in; a hard limit in the usual law
  double dead_zone = 0;     ///< [V] of reference without effect, on either side of zero; other: its corner is round
  double output_resistance = 0;  ///< [ohm] e_a = e - R_o i_a
  double lag = 0;                ///< [s] behind the slopes; other: two lags of half of it each
  double delay = 0;              ///< [s] of the reference
  double sampling = 0;           ///< [s] between the moments at which the driver looks at its reference; 0: always
  double play = 0;               ///< [V] of reference that a reversal takes up first: a worn potentiometer

  double current_limit = unlimited;  ///< [A] that it holds by giving less voltage. other: gives way by a little beyond

  /// The current only flows the way that the voltage asked for drives it; while it is blocked, the terminals show the
  /// back-EMF. Without a voltage below zero it flows one way only.
  bool one_quadrant = false;
  bool coasts = false;              ///< asked for nothing, it opens the circuit
  double conduction_rise = 0;       ///< [V] by which e_a is too high at no current, e > 0: V_d exp(-|i|/i_c);
  double conduction_current = 0.1;  ///< [A] i_c. other: V_d (1 - |i|/(3 i_c))^2 until the current flows all the time

  double chop_period = 0;   ///< [L_a/R_a] of a chopper whose current runs on through diodes; 0: none
  double chop_supply = 12;  ///< [V]
  double chop_decay = 0;    ///< [V] against which it runs on. other: and 4 % of the supply, the diodes

  /// [Hz] of the mains. Not zero: the output is a full-wave rectified sine of mean e, and the current cannot reverse;
  /// while it is blocked, the terminals show the back-EMF.
  double rectified = 0;
  /// [V] crest of the mains behind a half-controlled rectifier with free-wheeling diode, which fires late enough for
  /// the mean e. 0: uncontrolled.
  double crest = 0;
};

/// e_a -> i_a, torque; and the shaft's smooth losses
struct MotorParameters {
  double R_a = 1;               ///< [ohm] cold
  double L_a = 0;               ///< [H] below 10 us of L_a/R the current follows at once
  double K_b = 1;               ///< [V s/rad]
  double K_m = 1;               ///< [N m/A]
  double B = 0;                 ///< [N m s/rad]
  double J = 1;                 ///< [kg m2] all of it, whatever hangs at a compliant shaft
  double brush_drop = 0;        ///< [V] both brushes: V_b tanh(i/i_b); other: V_b (1 - exp(-|i|/i_b))
  double brush_current = 0.02;  ///< [A] i_b, some per cent of a small motor's rated current

  double heat_capacity = unlimited;  ///< [J/K] of the armature, cold when the plant is made, copper 0.00393/K
  double heat_resistance = 1;        ///< [K/W] to the room; other: half of both between the winding and the iron

  double reaction = 0;            ///< part of the flux that a large current takes: k x^2/(1 + x^2), x = i/i_k;
  double reaction_current = 1;    ///< [A] i_k. other: k tanh^2(x)
  double field_drop = 0;          ///< part of the flux that is lost as the field warms up: d (1 - exp(-t/tau));
  double field_time = 100;        ///< [s] tau. other: flux 1/(1 + d' w), w of two bodies
  double flux_hysteresis = 0;     ///< part of the flux that depends on where the current came from
  double coercive_current = 0.1;  ///< [A] by which the current must turn back to turn that over

  double windage = 0;           ///< [N m s2/rad2] of omega |omega| |omega/windage_omega|^(windage_exponent - 2)
  double windage_exponent = 2;  ///< 1.8 to 2.2 on real fans
  double windage_omega = 100;   ///< [rad/s]

  double bearing_drag = 0;            ///< [N m (s/rad)^(2/3)] c sign(omega) |omega|^(2/3);
  double bearing_exponent = 2.0 / 3;  ///< 0.5 to 0.8 from grease to oil, at 1 rad/s as before
};

/// Dry friction: holds up to T_c + T_s, slides at T_c + T_s exp(-(omega/omega_s)^2); other: exp(-|omega|/omega_s)
struct FrictionParameters {
  FrictionLaw law = FrictionLaw::bristle;
  double T_c = 0;            ///< [N m]
  double T_s = 0;            ///< [N m] Stribeck: what breaking away takes more
  double omega_s = 10;       ///< [rad/s]
  double deflection = 1e-4;  ///< [rad] of the bristle when it slips; smaller is stiffer and slower
  double T_d = 0;            ///< [N m] more in the positive direction, less in the negative one; at most T_c
  double B_d = 0;            ///< [N m s/rad] the same for viscous friction
  double gears = 0;          ///< of |torque of the motor - that of the load|, as each accelerates: more dry friction,
                             ///< needs T_c; other: of the sum of both sizes
  double warm_drop = 0;      ///< part of T_c, T_s, gears and B that goes as grease warms up: d (1 - exp(-t/tau));
  double warm_time = 100;    ///< [s] tau. other: what stays is (1 - d)^(1 - exp(-t/tau)), as viscosity does
};

/// The shaft itself
struct ShaftParameters {
  double cogging = 0;            ///< [N m] T sin(N theta + phase) ...
  double cogging_second = 0;     ///< ... and this part of it at twice the order
  double cogging_order = 12;     ///< N, a turn
  double cogging_phase = 0;      ///< [rad]
  double stiffness = unlimited;  ///< [N m/rad] between motor and load
  double damping = 0;            ///< [N m s/rad] the same; with a gap: while there is contact
  double J_2 = 0;                ///< [kg m2] on the load's side, out of J
  double gap = 0;                ///< [rad] backlash; needs stiffness
};

/// What the torque gauge sees; positive brakes positive rotation
struct LoadParameters {
  double torque = 0;           ///< [N m] a weight: does not reverse, pulls at rest too
  double eccentric = 0;        ///< [N m] of sin(theta + phase): a weight off centre
  double eccentric_phase = 0;  ///< [rad]
  double spring = 0;           ///< [N m/rad] of a spring, from the angle at which a run begins
  double spring_torque = 0;    ///< [N m] that it pulls with there
  double brake = 0;            ///< [N m] dry: holds up to this at rest, by a lining that gives 1e-4 rad
  double eddy_torque = 0;      ///< [N m] largest torque of an eddy-current brake
  double eddy_omega = 60;      ///< [rad/s] speed of that torque, cold
  double eddy_heating = 0;     ///< [1/J] by which eddy_omega rises with each joule in the disc, which cools in a minute
};

/// What the instruments make of it, beyond a gain and an offset, which are the channel's
struct SensorParameters {
  double tacho_lag = 0;      ///< [s] other: two lags, 0.8 and 0.2 of it
  double ripple = 0;         ///< reading = omega (1 + r sin(N theta + phase)) ...
  double ripple_second = 0;  ///< ... and this part of it at twice the order
  double ripple_order = 2;   ///< N, a turn
  double ripple_phase = 0;   ///< [rad]
  double tacho_stick = 0;    ///< [rad/s] by which the speed must change for the tacho's coupling to let go
  double delay = 0;          ///< [s] of speed and angle, as over a bus
  double torque_lag = 0;     ///< [s] other: two lags of half of it each
  double supply = 0;         ///< [V] of the supply in whose lead the current is read; 0: it is read at the armature
};

/// What the simulated bench is made of. Everything is off (or ideal) unless set: `{.motor = {.R_a = 31.8}, .friction =
/// {.T_c = 0.05}}`.
struct PlantParameters {
  Laws laws = Laws::usual;
  DriverParameters driver = {};
  MotorParameters motor = {};
  FrictionParameters friction = {};
  ShaftParameters shaft = {};
  LoadParameters load = {};
  SensorParameters sensors = {};

  /// Any further braking torque [N m] of omega, theta and time, for tests that hide what no library has.
  std::function<double(double omega, double theta, double t)> hidden_torque = nullptr;
  /// Any further voltage [V] lost in the armature circuit, of the current (0.2 ms ago), omega and theta.
  std::function<double(double i, double omega, double theta)> hidden_drop = nullptr;
};

/// @throws ConfigError where a parameter cannot be: J, R_a, ... not above zero.
void check(const PlantParameters& parameters);
void check(const LoadParameters& load);

}  // namespace emtb::simulated
