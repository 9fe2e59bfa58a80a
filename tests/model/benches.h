#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "model/catalogue.h"
#include "model/simulation.h"
#include "model/structure.h"

namespace emtb::testing_benches {

using TypicalSizes = std::map<std::string, double, std::less<>>;

/// A machine, what excites it, and how large each effect is on it where a diagnosis should see it.
struct TestBench {
  std::string name;
  ModelStructure structure;  ///< driven by u_ref, without effects
  std::vector<double> base;  ///< R_a, K_b, K_m, B, J
  Excitation
      excitation;  ///< from rest to full speed and, with friction, to rest again. Without friction it ends in motion:
                   ///< how long a shaft takes to stop has no derivative with respect to a friction that is not there
  TypicalSizes typical;  ///< `windage.c_w`; the catalogue's, but for what differs here
};

/// Values held for a time each, in turn.
struct Hold {
  double seconds, value;
};

inline Excitation holds(double interval, const std::vector<Hold>& plan) {
  Excitation x;
  for (const Hold& hold : plan) {
    const auto n = static_cast<std::size_t>(hold.seconds / interval + 0.5);
    for (std::size_t i = 0; i < n; ++i) {
      x.t.push_back(static_cast<double>(x.t.size()) * interval);
      x.u_ref.push_back(hold.value);
    }
  }
  return x;
}

/// Those of the catalogue, but for these.
inline TypicalSizes with_typical_sizes(TypicalSizes here) {
  for (const EffectInfo& effect : effect_catalogue()) {
    for (const EffectParameter& p : effect.parameters()) {
      here.try_emplace(std::string(effect.id) + "." + std::string(p.symbol), p.typical);
    }
  }
  return here;
}

/// The paper's bench: one direction, a driver that takes seconds, read at 200 Hz.
inline TestBench slow_bench() {
  TestBench b;
  b.name = "slow";
  b.structure.driver = {.gain = 18.33, .rise = 22.5, .fall = 20.4, .min = 0, .max = 110};
  b.base = {31.8, 0.67, 0.61, 1e-4, 3.4e-3};
  b.excitation = holds(5e-3, {{0.3, 0}, {2.5, 2}, {4, 6.5}, {2, 0.3}, {3.8, 0}});
  b.typical = with_typical_sizes({{"driver_slew.fall", 18},
                                  {"driver_saturation.e_max", 103.9},
                                  {"driver_delay.t_d", 0.0317},  // no whole number of readings
                                  {"speed_delay.t_d", 0.0317},
                                  {"armature_heating.C_th", 5},  // a hundredth of a real one: the run is short
                                  {"field_heating.tau", 40},
                                  {"pwm_drive.V_s", 104},
                                  {"supply_current.V_s", 104},
                                  {"coulomb_friction.T_c", 0.0547},
                                  {"friction_warmup.tau", 30},
                                  {"cogging.N", 4},
                                  {"cogging.phase", 0.5},
                                  {"eccentric_load.phase", 0.5},
                                  {"tacho_ripple.phase", 0.5}});
  return b;
}

/// A small servo: both directions, edges of milliseconds, read at 1 kHz.
inline TestBench fast_bench() {
  TestBench b;
  b.name = "fast";
  b.structure.driver = {.gain = 4, .rise = 2000, .fall = 2000, .min = -24, .max = 24};
  b.base = {1.2, 0.042, 0.042, 1e-5, 6.03e-5};
  b.excitation = holds(1e-3, {{0.05, 0}, {0.5, 2.13}, {0.6, -3.36}, {0.6, 6.5}, {0.4, 0.11}, {0.4, -0.37}, {0.4, 0}});
  b.typical = with_typical_sizes({{"driver_gain_error.k", 0.02},
                                  {"driver_gain_error.e_0", 0.1},
                                  {"driver_slew.rise", 500},
                                  {"driver_slew.fall", 600},
                                  {"driver_dead_zone.u_d", 0.07},
                                  {"driver_saturation.e_max", 22},
                                  {"driver_output_resistance.R_o", 0.2},
                                  {"current_limit.i_max", 6},
                                  {"driver_lag.tau", 0.01},
                                  {"driver_delay.t_d", 0.00537},
                                  {"speed_delay.t_d", 0.00537},
                                  {"presliding_friction.sigma_0", 0.5},
                                  {"discontinuous_conduction.V_d", 0.5},
                                  {"discontinuous_conduction.i_c", 0.3},
                                  {"pwm_drive.r", 1.3},
                                  {"pwm_drive.V_s", 26},
                                  {"pwm_drive.k", 0.1},
                                  {"armature_inductance.L_a", 2e-3},
                                  {"brush_drop.V_b", 0.4},
                                  {"brush_drop.i_lin", 0.02},
                                  {"armature_heating.C_th", 5},
                                  {"armature_reaction.k_i", 0.07},
                                  {"armature_reaction.i_k", 5},
                                  {"field_heating.tau", 40},
                                  {"coulomb_friction.T_c", 0.0027},
                                  {"stribeck_friction.T_s", 0.003},
                                  {"stribeck_friction.omega_s", 15},
                                  {"asymmetric_friction.T_d", 0.001},
                                  {"asymmetric_friction.B_d", 1e-6},
                                  {"windage.c_w", 2e-8},
                                  {"friction_warmup.tau", 30},
                                  {"cogging.T_cog", 0.01},
                                  {"cogging.N", 4},
                                  {"cogging.phase", 0.5},
                                  {"shaft_compliance.k", 5},
                                  {"shaft_compliance.d", 1e-3},
                                  {"shaft_compliance.J_2", 2e-5},
                                  {"bearing_drag.c_b", 4e-5},
                                  {"load_torque.T_L", 0.01},
                                  {"dry_brake.T_b", 0.006},
                                  {"eccentric_load.T_e", 0.003},
                                  {"eccentric_load.phase", 0.5},
                                  {"spring_load.k", 2e-4},
                                  {"spring_load.T_0", 0.003},
                                  {"eddy_brake.T_b", 0.02},
                                  {"eddy_brake.omega_b", 200},
                                  {"tacho_lag.tau", 0.007},
                                  {"tacho_ripple.phase", 0.5},
                                  {"tacho_offset.omega_0", 1.5},
                                  {"current_offset.i_0", 0.05},
                                  {"supply_current.V_s", 26}});
  return b;
}

}  // namespace emtb::testing_benches
