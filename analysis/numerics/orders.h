#pragma once

#include <span>
#include <vector>

namespace emtb {

/// A stretch of readings and the angle of the shaft at each.
struct TurningStretch {
  std::vector<double> angle;  ///< [rad]
  std::vector<double> value;
};

/// An order of the shaft: how often a turn something repeats.
struct Order {
  double per_turn = 0;
  double amplitude = 0;  ///< root mean square over the stretches, in the unit of the values
  double excess = 0;     ///< power, in multiples of that of its surroundings in the spectrum
};

/// The orders that stand out of the spectrum of the values over the angle, strongest first: those far above the median
/// of the orders around them, and clear in at least half of the stretches. Each stretch has a phase of its own.
/// Readings need not be evenly spaced in angle: at several speeds, an order is told also where there is less than one
/// reading a period.
/// @param lowest, highest [1/turn] where to look; stretches of fewer than three turns of `lowest` are left out
std::vector<Order> strong_orders(std::span<const TurningStretch> stretches, std::size_t at_most, double lowest = 0.5,
                                 double highest = 64);

/// x less its mean over 0.5 s around each reading: what changes slowly is not periodic, but leaks into every order.
/// @param interval [s] between readings
std::vector<double> without_slow_changes(std::vector<double> x, double interval);

/// What repeats with an order in a stretch: sine sin(order angle) + cosine cos(order angle), by least squares.
struct Wave {
  double sine = 0, cosine = 0;
  double share = 0;  ///< of the squares about the mean that it explains
};
Wave wave_of(const TurningStretch& stretch, double per_turn);

/// Takes the orders out of the values, by least squares.
void remove_orders(TurningStretch& stretch, std::span<const Order> orders);

}  // namespace emtb
