#include "paper/switch_on.h"

#include <algorithm>
#include <cmath>

#include "paper/bench.h"

namespace emtb::paper {
namespace {

constexpr double step = 1e-4;  // [s]

}  // namespace

SwitchOn::SwitchOn(const simulated::PlantParameters& parameters, double seconds) {
  simulated::Plant plant(parameters);
  charge_.push_back(0);
  omega_.push_back(0);
  for (int n = 0; n < std::lround(seconds / step); ++n) {
    plant.advance(step, printed::reference);
    peak_ = std::max(peak_, plant.i_a());
    fastest_ = std::max(fastest_, (plant.omega() - omega_.back()) / step);
    charge_.push_back(plant.charge());
    omega_.push_back(plant.omega());
  }
}

std::size_t SwitchOn::at(double t) const noexcept {
  return static_cast<std::size_t>(std::clamp(std::lround(t / step), 0L, static_cast<long>(charge_.size()) - 1));
}

double SwitchOn::mean_current(double from, double window) const noexcept {
  return (charge_[at(from + window)] - charge_[at(from)]) / window;
}

double SwitchOn::mean_acceleration(double window) const noexcept { return omega_[at(window)] / window; }

double SwitchOn::largest_reading(double window, double phase) const noexcept {
  double largest = 0;
  for (double from = -phase * window; at(from + window) + 1 < charge_.size(); from += window) {
    largest = std::max(largest, mean_current(from, window));
  }
  return largest;
}

double SwitchOn::window_for(double current) const noexcept {
  double window = step;
  while (at(window) + 1 < charge_.size() && mean_current(0, window) > current) window += step;
  return window;
}

simulated::PlantParameters past_the_driver(simulated::PlantParameters plant) {
  plant.driver.rise = plant.driver.fall = simulated::unlimited;
  return plant;
}

double inductance_for(const simulated::PlantParameters& plant, double current) {
  double low = 0, high = 64;  // [H]
  while (high - low > 0.01) {
    simulated::PlantParameters p = plant;
    p.motor.L_a = (low + high) / 2;
    (SwitchOn(p, 2).peak_current() > current ? low : high) = p.motor.L_a;
  }
  return (low + high) / 2;
}

}  // namespace emtb::paper
