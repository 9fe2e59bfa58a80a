#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "model/dual.h"
#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// A shaft that twists: motor and load are two bodies. The load's part of the inertia, J_2, is behind the spring;
/// friction stays on the motor's side, loads act on it.
struct ShaftCompliance {
  static constexpr EffectInfo info{
      .id = "shaft_compliance",
      .name = "shaft compliance",
      .stage = Stage::shaft,
      .equation = "J = J_1 + J_2; J_2 domega_2/dt = k dtheta + d domega - load",
      .what = "A coupling or a long shaft twists between motor and load.",
      .shows = "The speed rings after steps, at sqrt(k/J_2) and above.",
      .told_apart =
          "From armature_inductance and tacho_lag by the ringing. A driver that is slow against it never shows it.",
      .source = "two-mass model; Leonhard, Control of Electrical Drives; trapezoidal step, implicit, prewarped",
      .parameter_list =
          {{{.symbol = "k", .unit = "N m/rad", .null = infinity, .min = 1e-6, .max = 1e9, .typical = 50},
            {.symbol = "d", .unit = "N m s/rad", .null = 0, .min = 0, .max = 1e6, .typical = 0.01, .role = Role::shape},
            {.symbol = "J_2", .unit = "kg m2", .null = 0, .min = 0, .max = 1e6, .typical = 1e-3, .role = Role::shape}}},
      .parameter_count = 3,
      .memory = 2,
      .quick = true};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, Memory<Scalar> memory, const State<Scalar>& x, Balance<Scalar>& balance) {
    const auto& [k_as_it_is, d_as_it_is, J_2] = std::tie(p[0], p[1], p[2]);
    const Quickened<Scalar> by = quickened(k_as_it_is, balance.inertia - J_2, J_2, x.h);
    const Scalar k = k_as_it_is * by.stiffness, d = d_as_it_is * by.damping;
    Scalar& omega_before = memory[0];  // [rad/s] of the motor
    Scalar& started = memory[1];
    LoadBehindSpring<Scalar>& load = balance.behind_spring;
    if (value_of(started) == 0) {
      started = Scalar(1.0);
      load.omega = x.omega_start;
      load.twist = twist_at_rest(k, x, balance);
      if (value_of(load.twist) == 0) load.taken = Scalar(0.0);
    } else if (load.there) {
      load.end_step(0.5 * (omega_before + x.omega_start));
    }
    omega_before = x.omega_start;
    load.there = value_of(J_2) > 0;
    if (!load.there) return;
    // The spring's torque is linear in the mean speed of the motor over the step to come: what a trapezoidal step of
    // the load makes of it.
    const Scalar bent = soft_threshold(load.twist, 0.5 * balance.gap);
    // With a gap, teeth push and never pull: damping cannot hold what is leaving.
    const double pressed = value_of(bent) * value_of(k * bent + d * (x.omega_start - load.omega));
    const bool in_touch = value_of(balance.gap) == 0 || pressed > 0;
    const Scalar pushes = in_touch ? k * bent : Scalar(0.0);
    load.h = x.h;
    load.inertia = J_2 * (2.0 / x.h);
    load.stiffness = in_touch ? k * (0.5 * x.h) + d : Scalar(0.0);
    load.pushed = load.inertia * load.omega + pushes;
    const Scalar load_gives_way = load.inertia / (load.inertia + load.stiffness);
    balance.viscous += load.holds_back();
    balance.braking_torque += (pushes - load.stiffness * load.omega) * load_gives_way;
    balance.inertia -= J_2;
  }

  /// A trapezoidal step of h makes a ring of omega one of (2/h) atan(omega h/2), and lets it decay more slowly. By so
  /// much the spring has to be stiffer, and its damping greater, for it to ring as it should; as far as steps show it.
  template <class Scalar>
  struct Quickened {
    Scalar stiffness{1.0}, damping{1.0};
  };

  template <class Scalar>
  static Quickened<Scalar> quickened(const Scalar& k, const Scalar& J_1, const Scalar& J_2, double h) {
    constexpr double most = 1.2, least = 1e-3;  // [rad] of half a step
    if (!(value_of(J_1) > 0 && value_of(J_2) > 0)) return {};
    Scalar half = 0.5 * h * pow(k / J_1 + k / J_2, 0.5);
    if (value_of(half) < least) return {};
    if (value_of(half) > most) half = Scalar(most);
    const Scalar tangent = sin(half) / sin(half + 0.5 * std::numbers::pi);
    return {tangent * tangent / (half * half), 1.0 + tangent * tangent};
  }

  /// [rad] Where dry friction of the motor holds what pulls at a load at rest, the spring is bent by it.
  template <class Scalar>
  static Scalar twist_at_rest(const Scalar& k, const State<Scalar>& x, const Balance<Scalar>& balance) {
    const Scalar& pulls = balance.behind_spring.taken;
    const bool holds = std::abs(value_of(pulls)) <= value_of(balance.dry_friction);
    if (value_of(x.omega_start) != 0 || value_of(pulls) == 0 || !holds) return Scalar(0.0);
    return pulls / k + (value_of(pulls) > 0 ? 0.5 : -0.5) * balance.gap;
  }

  static std::vector<StartValues> starts(const Ranges& seen) {
    // [rad/s] From one that the response hardly follows to the quickest that rows at that distance show.
    const double slowest = 3 / std::max(seen.response, 1e-6), quickest = 0.8 / std::max(seen.sample, 1e-6);
    std::vector<double> frequencies = geometric(slowest, std::max(quickest, 3 * slowest), 5);
    // A resonance is narrow: from a start a third beside it, no descent finds it.
    if (seen.ringing > 0) frequencies.insert(frequencies.end(), {0.95 * seen.ringing, 1.05 * seen.ringing});
    std::vector<StartValues> all;
    for (const double share : {0.2, 0.5}) {  // of the inertia
      for (const double frequency : frequencies) {
        const double J_2 = share * seen.inertia, k = frequency * frequency * J_2 * (1 - share);
        all.push_back({k, 0.05 * k / frequency, J_2});
      }
    }
    return all;
  }

  static double twist_under(std::span<const double> p, double torque) { return torque / p[0]; }

  /// Two bodies that ring against each other.
  static std::string implausible(std::span<const double> p, const FittedMachine& machine) {
    return Plausible(info, p)
        .at_most(2, 0.98 * machine.J, "J, of which it is a part")
        .at_least(2, 0.01 * machine.J, "a hundredth of J: nothing hangs at the spring")
        .at_most("the damping", p[1] / (2 * std::sqrt(p[0] * p[2] * (1 - p[2] / machine.J))), 1, "",
                 "that of a shaft that does not ring");
  }
};

}  // namespace emtb
