#include "analysis/discover/samples.h"

#include <algorithm>
#include <cmath>

namespace emtb {

double range_of(const std::vector<double>& x) {
  double most = 0;
  for (const double v : x) most = std::max(most, std::abs(v));
  return most;
}

bool turns_both_ways(const Samples& samples) {
  const auto [low, high] = std::ranges::minmax_element(samples.omega);
  return low != samples.omega.end() && *low < 0 && *high > 0;
}

Samples samples_of(const WhatIsLeft& left, bool voltage) {
  constexpr std::size_t most = 3000;
  Samples s;
  double fastest = 0;
  std::size_t all = 0;
  for (const MissingTorque& run : left.runs) {
    all += run.t.size();
    for (const double omega : run.omega) fastest = std::max(fastest, std::abs(omega));
  }
  const std::size_t every = std::max<std::size_t>(1, (all + most - 1) / most);
  const bool alone = left.runs.size() == 1;
  constexpr std::size_t fifths = 5;
  s.paths = left.runs;
  s.groups = alone ? fifths : left.runs.size();
  for (std::size_t r = 0; r < left.runs.size(); ++r) {
    const MissingTorque& run = left.runs[r];
    for (std::size_t k = 0; k < run.t.size(); k += every) {
      if (std::abs(run.omega[k]) < moves * fastest) continue;
      s.path.push_back(r);
      s.place.push_back(k);
      s.group.push_back(alone ? k * fifths / run.t.size() : r);
      s.t.push_back(run.t[k]);
      s.omega.push_back(run.omega[k]);
      s.i_a.push_back(run.i_a[k]);
      s.theta.push_back(run.theta[k]);
      s.u_ref.push_back(run.u_ref[k]);
      s.acceleration.push_back(run.acceleration[k]);
      s.value.push_back(voltage ? run.voltage[k] : run.torque[k]);
    }
  }
  return s;
}

}  // namespace emtb
