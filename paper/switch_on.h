#pragma once

#include <vector>

#include "drivers/simulated/plant.h"

namespace emtb::paper {

/// A start from rest under the full reference, seen without instruments: what a meter could show of it.
class SwitchOn {
 public:
  /// @param seconds from rest; the driver takes 5 s to its full voltage
  explicit SwitchOn(const simulated::PlantParameters& plant, double seconds = 6);

  double peak_current() const noexcept { return peak_; }           ///< [A]
  double peak_acceleration() const noexcept { return fastest_; }   ///< [rad/s2]
  double mean_current(double from, double window) const noexcept;  ///< [A] from and window in s; before 0 none flows
  double mean_acceleration(double window) const noexcept;          ///< [rad/s2] of the first seconds

  /// The largest reading of a meter that averages over windows that follow each other, of which one begins `phase`
  /// (0 to 1 windows) before the switch-on. [A]
  double largest_reading(double window, double phase) const noexcept;

  /// How long a mean from the switch-on on must be to come down to this current. [s]
  double window_for(double current) const noexcept;

 private:
  std::size_t at(double t) const noexcept;

  std::vector<double> charge_, omega_;  ///< at multiples of the step
  double peak_ = 0, fastest_ = 0;
};

/// The same plant behind a contactor: the full voltage at once.
simulated::PlantParameters past_the_driver(simulated::PlantParameters plant);

/// The inductance at which the current of a start peaks at `current`. [H]
double inductance_for(const simulated::PlantParameters& plant, double current);

}  // namespace emtb::paper
