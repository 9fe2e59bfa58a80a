#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "analysis/numerics/equal_readings.h"
#include "analysis/record/angle_noise.h"
#include "analysis/record/error_column.h"
#include "hal/shared_column.h"
#include "hal/signal.h"
#include "session/session.h"

namespace emtb {

/// How a reading comes of the simulated signal.
enum class Functional {
  instant,    ///< its value
  mean,       ///< its mean from the beginning of the reading to the end (trapezoidal)
  increment,  ///< by how much it grew from the beginning to the end
  slope       ///< a sum of its values with weights: that of a line through an encoder's angles
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
  SharedColumn<double> begin, end;          ///< [s] of each reading, as recorded; the same for an instant
  SharedColumn<std::uint32_t> first, last;  ///< the grid points that stand for them
  SharedColumn<double> value;               ///< SI
  ErrorColumn sigma;           ///< what the reading may differ from a perfect model: noise, timing, noise of the input;
                               ///< the same for all models that are compared; empty until the run is weighed
  double autocorrelation = 0;  ///< of the errors, from one reading to the next
  double lsb = 0;              ///< SI, the instrument's step; 0: not known
  double window = 0;           ///< [s] over which the instrument averages; 0: not stated
  bool slow = false;           ///< fewer than half as many readings as the grid has points
  bool at_once = false;        ///< it reads the signal as it is, though slow, and not its mean since the reading before
  double late = 0;             ///< [samples of the grid] by which the instrument is read behind the others; 0 to 1
  std::vector<double> late_by_row;  ///< of the interval of the grid that ends at each point, where these differ
  std::vector<double> weight;  ///< of a slope: one for each grid point of each reading, one reading after the other
  std::vector<std::size_t> weight_from;  ///< where the weights of each reading begin
  std::vector<double> counted;     ///< variance that an encoder's whole counts leave in each reading; empty: not known
  double counted_correlation = 0;  ///< of these errors, from one reading to the next
  std::vector<EqualReadings> rounded;  ///< long stretches in which what the instrument rounds off is the same error

  std::size_t size() const { return value.size(); }

  /// How late an instant is that stands for a mean over less than a row: by half of its window.
  /// @param interval [s] of the grid @return [samples of the grid]
  double late_by_window(double interval) const {
    return functional == Functional::instant && window > 0 ? std::min(1.0, 0.5 * window / interval) : 0;
  }

  /// The signal of the simulation that a reading is formed of.
  Signal simulated() const { return functional == Functional::slope ? Signal::theta : signal; }

  /// The covariance of the errors of two readings: a first-order autoregression.
  double covariance(std::size_t i, std::size_t j) const;

  /// The simulated reading, from the simulated signal on the grid.
  template <class Get>
  double predicted(std::size_t i, const Get& simulated) const {
    const std::size_t a = first[i], b = last[i];
    if (functional == Functional::increment) return simulated(b) - simulated(a);
    if (functional == Functional::slope) {
      double slope = 0;
      for (std::size_t k = a; k <= b; ++k) slope += weight[weight_from[i] + k - a] * simulated(k);
      return slope;
    }
    if (a == b) return simulated(a);
    double sum = 0.5 * (simulated(a) + simulated(b));
    for (std::size_t k = a + 1; k < b; ++k) sum += simulated(k);
    return sum / static_cast<double>(b - a);
  }
};

/// What an instrument read, on the grid of what drives the model; readings beyond that are left out.
/// @param slow each reading is a mean: over its window, or since the reading before it
Observation observe(const Series& series, Signal signal, std::span<const double> grid, bool slow);

/// The speed that is compared where a run has an angle and no speed: the slope of the least-squares line through the
/// angles over 10 ms to either side, two samples at the least, at the times at which they were read. The same sum of
/// simulated angles is compared with it, so that no bend of the speed within the line counts as an error.
/// @param noise of each angle beyond its counts
Observation speed_of_encoder(const Series& theta, std::span<const double> grid, const AngleNoise& noise = {});

/// What an encoder counts over 20 ms or more, span after span: beside a tachogenerator, which it judges.
Observation angle_increments(const Series& theta, std::span<const double> grid, const AngleNoise& noise = {});

}  // namespace emtb
