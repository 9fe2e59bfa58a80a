#include "analysis/diagnose/left_floor.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <vector>

#include "analysis/fit/residuals.h"

namespace emtb {
namespace {

/// Was it guessed from the readings? What was declared or counted, and how exact a simulation is, is known.
bool is_a_guess(const NoiseFloor& floor) {
  return floor.from != FloorSource::declared && floor.from != FloorSource::counts &&
         floor.from != FloorSource::accuracy;
}

/// Sums over the readings of a signal.
struct Left {
  double readings = 0, squares = 0;             ///< [SI], of what is left where the reading is as sure as the floor
  double all = 0, sum = 0, squares_of_all = 0;  ///< [SI], of the readings themselves

  double variation() const { return std::sqrt(std::max(0.0, squares_of_all / all - sum * sum / (all * all))); }
};

}  // namespace

std::optional<Noise> floors_down_to_what_is_left(const Dataset& data, const Model& fitted) {
  constexpr double as_sure = 1.2, half = 0.5, fewest = 50;
  std::map<Signal, Left> left;
  for (const auto* records : {&data.train, &data.held_out}) {
    for (const Residuals& r : residuals(*records, fitted, fitted.values(), {})) {
      const Observation& o = *(*records)[r.record].find(r.signal);
      Left& of = left[r.signal];
      for (std::size_t i = 0; i < o.size(); ++i) {
        of.all += 1;
        of.sum += o.value[i];
        of.squares_of_all += o.value[i] * o.value[i];
        if (o.sigma[i] > as_sure * data.noise.at(r.signal).sigma) continue;
        of.readings += 1;
        of.squares += std::pow(r.value(static_cast<Eigen::Index>(i)) * o.sigma[i], 2);
      }
    }
  }
  std::optional<Noise> quieter;
  for (const auto& [signal, of] : left) {
    const NoiseFloor& floor = data.noise.at(signal);
    if (!is_a_guess(floor) || of.readings < fewest || !(of.variation() > 0)) continue;
    const double least = accuracy_of_a_simulation * of.variation();
    const double square = std::max(of.squares / of.readings, least * least);
    if (!(square < half * floor.sigma * floor.sigma)) continue;
    if (!quieter) quieter = data.noise;
    quieter->at(signal).sigma = std::sqrt(square);
  }
  return quieter;
}

}  // namespace emtb
