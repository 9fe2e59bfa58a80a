#pragma once

#include <span>
#include <string_view>
#include <tuple>

#include "model/dual.h"
#include "model/effect.h"
#include "model/effects/armature/armature_inductance.h"
#include "model/effects/driver/driver_dead_zone.h"
#include "model/effects/load/load_torque.h"
#include "model/effects/sensors/tacho_lag.h"
#include "model/effects/shaft/coulomb_friction.h"
#include "model/effects/shaft/windage.h"

namespace emtb {

/// All effects. A new one is its file and one line here, in the order of the stages.
using AllEffects = std::tuple<DriverDeadZone,      //
                              ArmatureInductance,  //
                              CoulombFriction,     //
                              Windage,             //
                              LoadTorque,          //
                              TachoLag>;

inline constexpr std::size_t effect_count = std::tuple_size_v<AllEffects>;

/// What is known of every effect, in the order of the list above.
std::span<const EffectInfo> effect_catalogue() noexcept;

/// @return the place in the catalogue. @throws ModelError naming the known ids.
std::size_t effect_index(std::string_view id);

/// How the effect of that place takes part in a step.
template <class Scalar>
ApplyEffect<Scalar> apply_of(std::size_t effect) {
  using Apply = ApplyEffect<Scalar>;
  static constexpr auto table = []<class... Effect>(std::tuple<Effect...>*) {
    return std::array<Apply, sizeof...(Effect)>{
        [](Parameters<Scalar> p, Memory<Scalar> memory, const State<Scalar>& x, Balance<Scalar>& balance) {
          if constexpr (Effect::info.memory > 0) {
            Effect::apply(p, memory, x, balance);
          } else {
            Effect::apply(p, x, balance);
          }
        }...};
  }(static_cast<AllEffects*>(nullptr));
  return table[effect];
}

}  // namespace emtb
