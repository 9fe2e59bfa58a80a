#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "analysis/discover/missing_torque.h"

namespace emtb {

/// Readings of what is left with the states in which it was missing, of all runs one after the other, thinned.
struct Samples {
  std::size_t groups = 0;                                         ///< what is left out in turn: runs, or fifths of one
  std::vector<std::size_t> group;                                 ///< of each sample
  std::vector<double> t, omega, i_a, theta, u_ref, acceleration;  ///< SI
  std::vector<double> value;                                      ///< [N m] or [V]
  std::span<const MissingTorque> paths;  ///< the runs as a whole, which a memory is followed along; outlive the samples
  std::vector<std::size_t> path, place;  ///< of each sample: its run, and where in it; none without paths

  std::size_t size() const { return value.size(); }
};

/// The states over which a law is drawn, of samples or of a run. @param quantity omega, i_a, acceleration, t, u_ref or
/// theta
template <class States>
const std::vector<double>& states_over(const States& s, std::string_view quantity) {
  return quantity == "omega"          ? s.omega
         : quantity == "i_a"          ? s.i_a
         : quantity == "acceleration" ? s.acceleration
         : quantity == "t"            ? s.t
         : quantity == "u_ref"        ? s.u_ref
                                      : s.theta;
}

/// Of the largest speed: below it friction holds.
inline constexpr double moves = 0.02;

/// The largest size of a quantity in the samples.
double range_of(const std::vector<double>& x);

/// Else a torque over the angle and a friction over it are one thing.
bool turns_both_ways(const Samples& samples);

/// The samples of the missing torque, or of the voltage, some 3000 at most and none at rest.
Samples samples_of(const WhatIsLeft& left, bool voltage);

}  // namespace emtb
