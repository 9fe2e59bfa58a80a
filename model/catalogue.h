#pragma once

#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "model/dual.h"
#include "model/effect.h"
#include "model/effects/air_gap/armature_reaction.h"
#include "model/effects/air_gap/field_heating.h"
#include "model/effects/armature/armature_heating.h"
#include "model/effects/armature/armature_inductance.h"
#include "model/effects/armature/brush_drop.h"
#include "model/effects/driver/coasting_driver.h"
#include "model/effects/driver/current_limit.h"
#include "model/effects/driver/discontinuous_conduction.h"
#include "model/effects/driver/driver_dead_zone.h"
#include "model/effects/driver/driver_delay.h"
#include "model/effects/driver/driver_gain_error.h"
#include "model/effects/driver/driver_lag.h"
#include "model/effects/driver/driver_output_resistance.h"
#include "model/effects/driver/driver_saturation.h"
#include "model/effects/driver/driver_slew.h"
#include "model/effects/driver/one_quadrant_driver.h"
#include "model/effects/driver/pwm_drive.h"
#include "model/effects/load/dry_brake.h"
#include "model/effects/load/eccentric_load.h"
#include "model/effects/load/eddy_brake.h"
#include "model/effects/load/load_torque.h"
#include "model/effects/load/spring_load.h"
#include "model/effects/sensors/current_offset.h"
#include "model/effects/sensors/speed_delay.h"
#include "model/effects/sensors/supply_current.h"
#include "model/effects/sensors/tacho_lag.h"
#include "model/effects/sensors/tacho_offset.h"
#include "model/effects/sensors/tacho_ripple.h"
#include "model/effects/sensors/torque_lag.h"
#include "model/effects/sensors/torque_offset.h"
#include "model/effects/shaft/asymmetric_friction.h"
#include "model/effects/shaft/backlash.h"
#include "model/effects/shaft/bearing_drag.h"
#include "model/effects/shaft/cogging.h"
#include "model/effects/shaft/coulomb_friction.h"
#include "model/effects/shaft/friction_warmup.h"
#include "model/effects/shaft/load_dependent_friction.h"
#include "model/effects/shaft/presliding_friction.h"
#include "model/effects/shaft/shaft_compliance.h"
#include "model/effects/shaft/stribeck_friction.h"
#include "model/effects/shaft/windage.h"

namespace emtb {

/// All effects. A new one is its file and one line here, in the order of the stages.
using AllEffects =
    std::tuple<DriverGainError, DriverSlew, DriverDeadZone, DriverSaturation, DriverOutputResistance, DriverLag,
               DriverDelay, CurrentLimit, OneQuadrantDriver, CoastingDriver, DiscontinuousConduction,
               PwmDrive,                                        //
               ArmatureHeating, ArmatureInductance, BrushDrop,  //
               ArmatureReaction, FieldHeating,                  //
               CoulombFriction, StribeckFriction, AsymmetricFriction, LoadDependentFriction, PreslidingFriction,
               Windage, BearingDrag, FrictionWarmup,                        //
               Cogging, Backlash, ShaftCompliance,                          //
               LoadTorque, DryBrake, EccentricLoad, SpringLoad, EddyBrake,  //
               TachoRipple, TachoOffset, TachoLag, SpeedDelay, TorqueOffset, TorqueLag, CurrentOffset, SupplyCurrent>;

inline constexpr std::size_t effect_count = std::tuple_size_v<AllEffects>;

/// What is known of every effect, in the order of the list above.
std::span<const EffectInfo> effect_catalogue() noexcept;

/// That no effect has this id, and which was meant or, where none is near, which there are.
/// @param others that would be known beside the catalogue
std::string no_such_effect(std::string_view id, std::vector<std::string> others);

/// @return the place in the catalogue. @throws ModelError naming those that were meant, or the known ids.
std::size_t effect_index(std::string_view id);

/// Where a search for an effect starts, given how far the machine went: the catalogue's null values, or for effects
/// with shapes several sets of values. An amplitude that can be null is not meant.
std::vector<StartValues> starts_of(std::size_t effect, const Ranges& seen);

/// Where it starts beside any start of the effect that it needs, which has bent to do without it; empty: it does not.
std::vector<StartValues> starts_beside_what_it_needs(std::size_t effect, const Ranges& seen);

/// [rad] By how much an effect lets a torque [N m] twist the shaft; 0: not at all.
double twist_under(std::size_t effect, std::span<const double> values, double torque);

/// `coulomb_friction.T_c`
std::string full_name(const EffectInfo& effect, std::size_t parameter = 0);

/// Why an effect with these values is not that effect on such a machine, in words: `J_2 is 0.012 kg m2, not below 0.011
/// kg m2, J`. Empty: it may be.
std::string implausible(std::size_t effect, std::span<const double> values, const FittedMachine& machine);

/// What an effect needs, for people: `coulomb_friction, a torque gauge`; empty: nothing but the motor.
std::string needs_of(const EffectInfo& effect);

/// The effects that a running machine is watched for, first things first.
std::vector<std::size_t> watched_effects();

/// The first parameter of a watched effect where this makes up a share of what the machine does.
double size_at(std::size_t effect, double share, const Ranges& seen);

/// An effect that adds the same to the equations in every step: its apply() takes no state.
template <class Effect>
concept Steady = requires(Parameters<double> p, Balance<double>& balance) {
  Effect::apply(p, balance);
};

bool is_steady(std::size_t effect);

/// How the effect of that place takes part in a step.
template <class Scalar>
ApplyEffect<Scalar> apply_of(std::size_t effect) {
  using Apply = ApplyEffect<Scalar>;
  static constexpr auto table = []<class... Effect>(std::tuple<Effect...>*) {
    return std::array<Apply, sizeof...(Effect)>{
        [](Parameters<Scalar> p, Memory<Scalar> memory, const State<Scalar>& x, Balance<Scalar>& balance) {
          if constexpr (Steady<Effect>) {
            Effect::apply(p, balance);
          } else if constexpr (Effect::info.memory > 0) {
            Effect::apply(p, memory, x, balance);
          } else {
            Effect::apply(p, x, balance);
          }
        }...};
  }(static_cast<AllEffects*>(nullptr));
  return table[effect];
}

}  // namespace emtb
