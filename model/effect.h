#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <string_view>
#include <tuple>
#include <vector>

#include "hal/signal.h"
#include "model/load_behind_spring.h"

namespace emtb {

/// Where in the machine an effect acts, in the order in which a step walks through it.
enum class Stage { driver, armature, air_gap, shaft, load, sensors };
std::string_view name_of(Stage stage) noexcept;

inline constexpr double infinity = std::numeric_limits<double>::infinity();

/// What a parameter is to its effect.
enum class Role {
  amplitude,  ///< at its null the effect is absent
  limit,      ///< the same, in place of a limit that the model knows: absent where it equals that one
  shape,      ///< how the effect acts (the speed at which friction falls): no null. Where the amplitude beside it is
              ///< null it means nothing, and is what a diagnosis tries several values of
  order,      ///< [1/turn] a shape: how often a turn the effect repeats
  phase,      ///< [rad] a shape: at which angle of the shaft
  supply  ///< [V] a shape: the voltage that the driver is fed with, of which the bench tells something (fit/supply.h)
};

/// [N m], or per rad/s or its square: the bound of what has the size of the machine, which may be a watch, a mill or an
/// axis that moves by millimetres a second, in N and m. What is too much of it for one machine its stall torque tells.
inline constexpr double any_torque = 1e9;

/// A parameter of an effect.
struct EffectParameter {
  std::string_view symbol;  ///< `T_c`
  std::string_view unit;    ///< `N m`
  double null = 0;  ///< at which the effect is absent; infinity: it fades as the parameter grows, like that of a
                    ///< large heat capacity. Of a shape or a limit merely a usual value
  double min = 0;   ///< bounds of any physical value, from a watch to a machine tool
  double max = 0;
  double typical =
      0;  ///< on a motor of some 100 W; for a formula where its fit starts. Only its order of magnitude counts
  Role role = Role::amplitude;

  constexpr bool is_shape() const { return role != Role::amplitude && role != Role::limit; }
};

/// What an effect's derivatives at its null tell a search.
enum class AtNull {
  all,     ///< of what size it is, to first order
  small,   ///< that of a small one: it acts after an edge is over, where they are zero. Tried at sizes, too
  nothing  ///< tried at sizes of its own
};

/// Effects that do nearly the same, so that what one of them cannot explain another may.
enum class Family {
  none,
  driver_edges,  ///< how a driver follows a step of its reference
  late_speed,    ///< by how much a speed is read late
};

/// `count` values from `least` to `most`, each the same multiple of the one before.
inline std::vector<double> geometric(double least, double most, int count) {
  std::vector<double> all;
  for (int i = 0; i < count; ++i) all.push_back(least * std::pow(most / least, i / (count - 1.0)));
  return all;
}

/// How far a machine went in some data: the scale on which an effect's shape is to be looked for.
struct Ranges {
  double reference = 0;       ///< [V] largest |u_ref|
  double voltage = 0;         ///< [V] largest |e_a|
  double supply = 0;          ///< [V] known limit of the driver; the same, where it has none
  double current = 0;         ///< [A] largest |i_a|
  double torque = 0;          ///< [N m] that this current makes
  double speed = 0;           ///< [rad/s] largest |omega|
  double duration = 0;        ///< [s] of the longest run
  double sample = 0;          ///< [s] between two rows of the quickest run
  double logging = 0;         ///< [s] by how much a reading or an edge may be late for how the runs were logged
  double logged_lag = 0;      ///< [s] the same of what lags: less, where no timing has its shape
  double heat = 0;            ///< [J] lost in R_a in the hottest run
  double inertia = 0;         ///< [kg m2] of the fitted model
  double response = 0;        ///< [s] with which the fitted model's speed follows the voltage
  double twist = 0;           ///< [rad] of the fitted model's shaft under this torque; 0: it is rigid
  double rise = 0, fall = 0;  ///< [V/s] known limits of the driver
  double ringing = 0;         ///< [rad/s] at which what is left of the speed rings; 0: it does not

  /// [s] Of a lag or delay: none, and from one that is hardly more than logging to one that outlasts the response.
  std::vector<double> edge_times() const {
    const double least = std::max(logged_lag > 0 ? logged_lag : logging, 1e-6);
    const double most = std::max(10 * least, std::min(3 * response, 0.2 * duration));
    std::vector<double> times = geometric(least, most, 5);
    times.insert(times.begin(), 0);
    return times;
  }
};

/// A machine as it was fitted, and how far it went: what the values of an effect are held against. As ratios, times and
/// speeds, they hold also where no reading fixes the scale of the torques.
struct FittedMachine {
  double R_a = 0, K_b = 0, K_m = 0, B = 0, J = 0;  ///< [ohm], [V s/rad], [N m/A], [N m s/rad], [kg m2]
  bool current_driven = false;
  Ranges seen;
  double turns = infinity;           ///< that the shaft makes in one run at most
  bool parts_of_a_turn_tell = true;  ///< what repeats with the angle is at the same place of its turn in all runs, or
                                     ///< explains nearly all that there is in several

  /// [N m] that the motor makes at standstill with the most that it was given.
  double stall_torque() const { return K_m * (current_driven ? seen.current : seen.voltage / R_a); }

  /// [s] with which the speed follows the voltage.
  double time_constant() const { return J / (B + (current_driven ? 0 : K_b * K_m / R_a)); }
};

/// Values of all parameters of one effect from which a search starts. (The library needs three, a user's formula may
/// have more.)
using StartValues = std::array<double, 20>;

/// How a running machine is watched for an effect that its model lacks, by the first parameter. Such an effect states
/// beside `apply`, in a function `size_at(share, seen)`, how large it is where it makes up that share of what the
/// machine does.
struct Watch {
  int rank = 0;        ///< there is room for a few at a time: the lowest first
  bool varies = true;  ///< within a run; otherwise it is there or it is not
};

/// A change of a parameter while the machine runs, told to a person: `the motor needs 0.01 N m more than before: ...`.
struct ChangeWords {
  std::string_view what;  ///< `the motor needs`; empty: there are no words for it
  std::string_view more;  ///< what may have happened: `a brake left on?`
  std::string_view less;
};

/// What must be there of a bench for an effect to be one of it, and to show in its records.
struct BenchParts {
  bool driver = false;          ///< the model begins with its reference
  bool voltage = false;         ///< feeds the armature; of a current drive's circuit nothing shows
  bool field_winding = false;   ///< permanent magnets have none
  bool tachogenerator = false;  ///< the speed is an instrument's reading, and not made from an encoder's angle
  bool torque_gauge = false;
  bool current = false;  ///< measured
};

/// What an effect is, for programs and for people: `emtb effects ID` prints it.
struct EffectInfo {
  static constexpr std::size_t max_parameters = std::tuple_size_v<StartValues>;

  std::string_view id;  ///< fixed: files and checks rely on it
  std::string_view name;
  Stage stage{};
  std::string_view equation;
  std::string_view what;        ///< the physics in a sentence
  std::string_view shows;       ///< how it looks in the residuals, and what excites it
  std::string_view told_apart;  ///< what it is taken for, and what separates them
  std::string_view source;
  std::array<EffectParameter, max_parameters> parameter_list{};
  std::size_t parameter_count = 1;
  std::size_t memory = 0;            ///< how many states of its own it keeps
  bool opposes_motion = false;       ///< an amplitude that cannot be negative
  std::optional<Signal> clips = {};  ///< acts beyond its parameter only: what the data reach of it is its null
  AtNull at_null = AtNull::all;
  Family family = Family::none;
  bool periodic = false;         ///< in the angle; its shapes are found from the data's own spectrum
  bool quick = false;            ///< with a time constant of its own that may be far below the shaft's
  bool dry_friction = false;     ///< it alone: brakes the same at any speed
  bool brakes_by_speed = false;  ///< adds what the speed says to braking torque and dry friction, and nothing else
  bool in_time = false;          ///< goes on with the time itself, or with what was before, whatever the machine does
  std::optional<Watch> watch = {};  ///< absent: it repeats, fades or needs a shape to be found; not while a motor runs
  ChangeWords changed = {};
  std::optional<Signal> reads = {};  ///< of a sensor: whose reading it describes; not seen where that is not measured
  bool corrects_load = false;        ///< of a gauge, and so a measured load that drives the model: the motion tells it
  std::string_view needs = {};       ///< the effect without which this one makes no sense
  BenchParts bench = {};             ///< what must be there

  /// Neither amplitude nor null to be seen from: the effect is there or not, and is judged by trying it.
  constexpr bool fades() const {
    if (at_null == AtNull::nothing) return true;
    bool only_shapes = true;
    for (const EffectParameter& p : parameters()) {
      if (p.null == infinity) return true;
      only_shapes = only_shapes && p.is_shape();
    }
    return only_shapes;
  }

  /// There or not, with nothing to be told but what feeds it: only what is lost without it says whether it is there.
  constexpr bool has_no_size() const {
    for (const EffectParameter& p : parameters()) {
      if (p.role != Role::supply) return false;
    }
    return true;
  }

  /// The place of the first parameter of that role.
  constexpr std::optional<std::size_t> place_of(Role role) const {
    for (std::size_t i = 0; i < parameter_count; ++i) {
      if (parameter_list[i].role == role) return i;
    }
    return std::nullopt;
  }

  /// It holds the current back: where nobody reads the terminals, as the edges of a driver do.
  constexpr bool holds_current() const { return stage == Stage::armature && quick; }

  /// It repeats several times a turn, how often is to be found.
  constexpr bool is_wave() const { return periodic && place_of(Role::order); }

  /// A torque that does, so that a shaft that stops rests between its waves.
  constexpr bool is_detent() const { return is_wave() && !reads; }

  /// Do both shape the same, so that one of them may stand in for the other?
  constexpr bool same_family(const EffectInfo& other) const { return family != Family::none && family == other.family; }

  constexpr std::span<const EffectParameter> parameters() const { return {parameter_list.data(), parameter_count}; }
};

/// What a step knows of the machine: at mid-step for driver to load (extrapolated, second order), at its end for
/// sensors.
template <class Scalar>
struct State {
  double t = 0;          ///< [s] from the start of the run
  double field_on = 0;   ///< [s] since the field was switched on
  double h = 0;          ///< [s] length of the step; 0: the reading at the very start
  double u_ref = 0;      ///< [V] reference held over the step
  Scalar e_a{};          ///< [V] terminal voltage
  Scalar i_a{};          ///< [A]
  Scalar omega{};        ///< [rad/s]
  Scalar theta{};        ///< [rad] measured where it is, see Excitation::angle
  Scalar place{};        ///< [rad] the same, but simulated where a measured angle wanders
  Scalar omega_start{};  ///< [rad/s] at the start of the step
  double temperature = std::numeric_limits<double>::quiet_NaN();  ///< [degC] where measured
};

/// What the effects act on: the terms of the equations of one step. Effects add to them or change them, each in its
/// stage.
template <class Scalar>
struct Balance {
  // driver: u -> delay -> clamp(gain u + offset, min, max) -> slew -> lag -> e -> e_a
  Scalar u{};                   ///< [V] reference as the driver understands it
  Scalar gain{};                ///< [V/V]
  Scalar min{}, max{};          ///< [V]
  Scalar rise{}, fall{};        ///< [V/s] slew limits of the output
  Scalar delay{};               ///< [s] of the reference
  Scalar offset{};              ///< [V] of the target
  Scalar lag{};                 ///< [s] of the output
  Scalar output_resistance{};   ///< [ohm]
  Scalar light_load_rise{};     ///< [V] by which the output rises as the current vanishes
  Scalar light_load_current{};  ///< [A] on which it does
  Scalar chop_period{};         ///< [1] of a chopper, in time constants L_a/R_a; 0: its current has no gaps
  Scalar chop_supply{};         ///< [V] that it chops
  Scalar chop_decay{};          ///< [V] against which the current runs on between the pulses
  Scalar current_limit{};       ///< [A] that the driver does not exceed
  bool one_quadrant = false;    ///< the driver takes no current back
  bool lets_go = false;         ///< asked for nothing, it opens the circuit
  // armature: e_a = R i + L di/dt + K_b flux omega + contact drop
  Scalar resistance{};    ///< [ohm]
  Scalar inductance{};    ///< [H]
  Scalar contact_drop{};  ///< [V] opposes the current; >= 0
  Scalar contact_knee{};  ///< [A] on which the drop bends: it is contact_drop tanh(i/contact_knee)
  // air gap
  Scalar flux{};           ///< [1] factor on K_b and K_m
  Scalar reaction{};       ///< [1] by which the current weakens it at most
  Scalar reaction_knee{};  ///< [A] at which it does so by half of that
  // shaft and load: K_m flux i = J domega/dt + B omega + braking_torque + dry friction
  Scalar inertia{};         ///< [kg m2]
  Scalar viscous{};         ///< [N m s/rad]
  Scalar gap{};             ///< [rad] play of the shaft's spring
  Scalar braking_torque{};  ///< [N m] any smooth torque; positive brakes positive rotation
  Scalar load_torque{};     ///< [N m] the same, taken by the load: what the gauge sees
  Scalar dry_friction{};    ///< [N m] opposes motion, holds up to this at rest; >= 0
  Scalar bristle{};         ///< [N m/rad] of that friction before it slips; 0: it does not give
  Scalar gear_friction{};   ///< [1] of the torque that the gears carry: dry friction, too; >= 0
  Scalar brake{};           ///< [N m] dry friction of the load: what the gauge sees of it; >= 0
  LoadBehindSpring<Scalar> behind_spring;
  // sensors
  Scalar omega_reading{};   ///< [rad/s]
  Scalar i_a_reading{};     ///< [A]
  Scalar torque_reading{};  ///< [N m]
  Scalar
      angle_behind{};  ///< [rad] by which the shaft is ahead of the integral of its speed's reading; like load_offset
  Scalar reading_delay{};  ///< [s] by which speed and angle are read late
  Scalar load_offset{};    ///< [N m] by which a measured load is read too large; set at the end of the step before
};

template <class Scalar>
using Parameters = std::span<const Scalar>;
template <class Scalar>
using Memory = std::span<Scalar>;

/// How an effect takes part in a step.
template <class Scalar>
using ApplyEffect = void (*)(Parameters<Scalar>, Memory<Scalar>, const State<Scalar>&, Balance<Scalar>&);

}  // namespace emtb
