#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <span>
#include <string_view>

namespace emtb {

/// Where in the machine an effect acts, in the order in which a step walks through it.
enum class Stage { driver, armature, air_gap, shaft, load, sensors };
std::string_view name_of(Stage stage) noexcept;

/// A parameter of an effect. At its null value the effect is absent.
struct EffectParameter {
  std::string_view symbol;  ///< `T_c`
  std::string_view unit;    ///< `N m`
  double null = 0;
  double min = 0;  ///< bounds of any physical value, from a watch to a machine tool
  double max = 0;
};

/// What an effect is, for programs and for people: `emtb effects ID` prints it.
struct EffectInfo {
  static constexpr std::size_t max_parameters = 3;

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
  std::size_t memory = 0;       ///< how many states of its own it keeps
  bool opposes_motion = false;  ///< an amplitude that cannot be negative

  constexpr std::span<const EffectParameter> parameters() const { return {parameter_list.data(), parameter_count}; }
};

/// What a step knows of the machine: at mid-step for driver to load (extrapolated, second order), at its end for
/// sensors.
template <class Scalar>
struct State {
  double t = 0;      ///< [s] from the start of the run
  double h = 0;      ///< [s] length of the step; 0: the reading at the very start
  double u_ref = 0;  ///< [V] reference held over the step
  Scalar e_a{};      ///< [V] terminal voltage
  Scalar i_a{};      ///< [A]
  Scalar omega{};    ///< [rad/s]
  Scalar theta{};    ///< [rad]
};

/// What the effects act on: the terms of the equations of one step. Effects add to them or change them, each in its
/// stage.
template <class Scalar>
struct Balance {
  // driver: u -> clamp(gain u, min, max) -> slew -> e_a
  Scalar u{};             ///< [V] reference as the driver understands it
  Scalar gain{};          ///< [V/V]
  Scalar min{}, max{};    ///< [V]
  Scalar rise{}, fall{};  ///< [V/s] slew limits of the output
  // armature: e_a = R i + L di/dt + K_b flux omega + voltage_drop
  Scalar resistance{};    ///< [ohm]
  Scalar inductance{};    ///< [H]
  Scalar voltage_drop{};  ///< [V]
  // air gap
  Scalar flux{};  ///< [1] factor on K_b and K_m
  // shaft and load: K_m flux i = J domega/dt + B omega + braking_torque + dry friction
  Scalar viscous{};         ///< [N m s/rad]
  Scalar braking_torque{};  ///< [N m] any smooth torque; positive brakes positive rotation
  Scalar load_torque{};     ///< [N m] the same, taken by the load: what the gauge sees
  Scalar dry_friction{};    ///< [N m] opposes motion, holds up to this at rest; >= 0
  // sensors
  Scalar omega_reading{};   ///< [rad/s]
  Scalar i_a_reading{};     ///< [A]
  Scalar torque_reading{};  ///< [N m]
};

template <class Scalar>
using Parameters = std::span<const Scalar>;
template <class Scalar>
using Memory = std::span<Scalar>;

/// How an effect takes part in a step.
template <class Scalar>
using ApplyEffect = void (*)(Parameters<Scalar>, Memory<Scalar>, const State<Scalar>&, Balance<Scalar>&);

}  // namespace emtb
