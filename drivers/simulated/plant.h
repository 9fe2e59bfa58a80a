#pragma once

#include <functional>
#include <limits>

namespace emtb::simulated {

/// How the plant's dry friction works. Neither law is the model's (a sign function with an implicit step): a diagnosis
/// that is judged on its own equations is not judged.
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
  double gain = 1;               ///< [V/V]
  double rise = unlimited;       ///< [V/s] de/dt <= rise
  double fall = unlimited;       ///< [V/s] -fall <= de/dt
  double min = -unlimited;       ///< [V]
  double max = unlimited;        ///< [V]
  double dead_zone = 0;          ///< [V] of reference without effect, on either side of zero
  double output_resistance = 0;  ///< [ohm] e_a = e - R_o i_a
};

/// e_a -> i_a, torque; and the shaft's smooth losses
struct MotorParameters {
  double R_a = 1;               ///< [ohm]
  double L_a = 0;               ///< [H] below 10 us of L_a/R the current follows at once
  double K_b = 1;               ///< [V s/rad]
  double K_m = 1;               ///< [N m/A]
  double B = 0;                 ///< [N m s/rad]
  double J = 1;                 ///< [kg m2]
  double brush_drop = 0;        ///< [V] both brushes: brush_drop tanh(i_a/brush_current)
  double brush_current = 0.02;  ///< [A] some per cent of a small motor's rated current
  double windage = 0;           ///< [N m s2/rad2] of omega |omega|
};

/// Dry friction: holds up to T_c + T_s, slides at T_c + T_s exp(-(omega/omega_s)^2)
struct FrictionParameters {
  FrictionLaw law = FrictionLaw::bristle;
  double T_c = 0;            ///< [N m]
  double T_s = 0;            ///< [N m] Stribeck: what breaking away takes more
  double omega_s = 10;       ///< [rad/s]
  double deflection = 1e-4;  ///< [rad] of the bristle when it slips; smaller is stiffer and slower
};

/// What the torque gauge sees; positive brakes positive rotation
struct LoadParameters {
  double torque = 0;       ///< [N m] a weight: does not reverse, pulls at rest too
  double eddy_torque = 0;  ///< [N m] largest torque of an eddy-current brake
  double eddy_omega = 60;  ///< [rad/s] speed of that torque
};

/// What the simulated bench is made of. Everything is off (or ideal) unless set: `{.motor = {.R_a = 31.8}, .friction =
/// {.T_c = 0.05}}`.
struct PlantParameters {
  DriverParameters driver = {};
  MotorParameters motor = {};
  FrictionParameters friction = {};
  LoadParameters load = {};
  double tacho_lag = 0;  ///< [s]

  /// Any further braking torque [N m] of omega, theta and time, for tests that hide what no library has.
  std::function<double(double omega, double theta, double t)> hidden_torque = nullptr;
};

/// A driver, a separately excited DC motor and its load, as they would behave.
///
/// Deliberately not the code of `model/`: classical Runge-Kutta at 0.1 ms or less, friction by another law, exact
/// slopes of the driver. About 1 us for a millisecond. Not thread-safe.
class Plant {
 public:
  /// At rest, driver at zero (or at the nearest voltage that it can give).
  /// @throws ConfigError where a parameter cannot be: J, R_a, ... not above zero.
  explicit Plant(PlantParameters parameters);

  /// @param dt [s] @param reference [V] held for all of dt
  void advance(double dt, double reference) noexcept;

  // The truth at the present time, before any sensor but the tachogenerator.
  double time() const noexcept { return time_; }                                    ///< [s] since construction
  double e_a() const noexcept;                                                      ///< [V]
  double i_a() const noexcept { return state_.i; }                                  ///< [A]
  double omega() const noexcept { return state_.omega; }                            ///< [rad/s]
  double theta() const noexcept { return state_.theta; }                            ///< [rad] unbounded
  double tacho() const noexcept { return lag_ > 0 ? state_.tacho : state_.omega; }  ///< [rad/s] after its lag
  double load_torque() const noexcept { return load_torque(state_.omega); }         ///< [N m] at the shaft
  double charge() const noexcept { return state_.charge; }  ///< [A s] integral of i_a: its differences are exact means

  const PlantParameters& parameters() const noexcept { return p_; }

 private:
  struct State {
    double e = 0;  ///< [V] inside the driver
    double i = 0;
    double omega = 0;
    double theta = 0;
    double tacho = 0;
    double charge = 0;
  };
  struct Slope {
    double i = 0, omega = 0, theta = 0, tacho = 0, charge = 0;
  };
  /// Dry friction during one step: a constant torque, some damping while the bristle bends, or stuck.
  struct Grip {
    double torque = 0;   ///< [N m]
    double damping = 0;  ///< [N m s/rad]
    double limit = 0;    ///< [N m] of both together
    bool stuck = false;
  };

  double target(double reference) const noexcept;
  double driver_after(double e, double target, double dt) const noexcept;
  double armature_current(double voltage, double guess) const noexcept;
  double load_torque(double omega) const noexcept;
  double slip_torque(double omega) const noexcept;
  double torque_without_friction(double omega, double theta, double i, double t) const noexcept;
  Slope slope(const State& x, double e, double t, const Grip& grip, double& i) const noexcept;
  State integrate(const State& from, double dt, double target, const Grip& grip) const noexcept;
  void step_bristle(double dt, double target) noexcept;
  void step_hard(double dt, double target, int depth) noexcept;
  Grip bend(double dt) noexcept;

  PlantParameters p_;
  State state_;
  double time_ = 0;
  double longest_step_ = 0;  ///< [s]
  double inductance_ = 0;    ///< [H] 0 where too small to matter
  double lag_ = 0;           ///< [s] 0 where too small to matter
  double resistance_ = 0;    ///< [ohm] armature and driver
  double stiffness_ = 0;     ///< [N m/rad] of the bristle
  double damping_ = 0;       ///< [N m s/rad] of the bristle
  double bristle_ = 0;       ///< [rad]
  bool stuck_ = true;        ///< the hard law's state
};

}  // namespace emtb::simulated
