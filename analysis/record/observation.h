#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "hal/signal.h"
#include "session/session.h"

namespace emtb {

/// How a reading comes of the simulated signal.
enum class Functional {
  instant,   ///< its value
  mean,      ///< its mean from the beginning of the reading to the end (trapezoidal)
  increment  ///< by how much it grew from the beginning to the end
};

/// Who made a reading.
enum class Origin {
  instrument,      ///< read as it stands in the session
  slope_of_angle,  ///< a speed, the slope of a line through an encoder's angles
  counts           ///< an encoder's counts over a time
};

/// What one instrument read of one signal during a run, in the terms of the simulation: each reading is a linear
/// functional of the simulated signal over a time of its own, and has an error.
///
/// A slow averaging meter is part of the model of the measurement, never interpolated.
struct Observation {
  Signal signal{};
  Functional functional = Functional::instant;
  Origin origin = Origin::instrument;
  std::vector<double> begin, end;          ///< [s] of each reading, as recorded; the same for an instant
  std::vector<std::uint32_t> first, last;  ///< the grid points that stand for them
  std::vector<double> value;               ///< SI
  std::vector<double> sigma;   ///< what the reading may differ from a perfect model: noise, timing, noise of the input;
                               ///< the same for all models that are compared; empty until the run is weighed
  double autocorrelation = 0;  ///< of the errors, from one reading to the next
  double lsb = 0;              ///< SI, the instrument's step; 0: not known
  double window = 0;           ///< [s] over which the instrument averages; 0: not stated
  bool slow = false;           ///< fewer than half as many readings as the grid has points

  std::size_t size() const { return value.size(); }

  /// The covariance of the errors of two readings: a first-order autoregression.
  double covariance(std::size_t i, std::size_t j) const;

  /// The simulated reading, from the simulated signal on the grid.
  template <class Get>
  double predicted(std::size_t i, const Get& simulated) const {
    const std::size_t a = first[i], b = last[i];
    if (functional == Functional::increment) return simulated(b) - simulated(a);
    if (a == b) return simulated(a);
    double sum = 0.5 * (simulated(a) + simulated(b));
    for (std::size_t k = a + 1; k < b; ++k) sum += simulated(k);
    return sum / static_cast<double>(b - a);
  }
};

/// What an instrument read, on the grid of what drives the model; readings beyond that are left out.
/// @param slow each reading is a mean: over its window, or since the reading before it
Observation observe(const Series& series, Signal signal, std::span<const double> grid, bool slow);

/// The angular velocity from an encoder's angle: slope of a least-squares line over +-`half` samples, one value every
/// `half`.
Series speed_from_angle(const Series& theta, std::size_t half);

/// The speed that is compared where a run has an angle and no speed.
Observation speed_of_encoder(const Series& theta, std::span<const double> grid);

/// What an encoder counts over 20 ms or more, span after span: beside a tachogenerator, which it judges.
Observation angle_increments(const Series& theta, std::span<const double> grid);

}  // namespace emtb
