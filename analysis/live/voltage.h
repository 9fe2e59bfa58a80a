#pragma once

#include <algorithm>
#include <cmath>

#include "analysis/live/steady_mean.h"
#include "hal/signal.h"
#include "model/catalogue.h"
#include "model/slew.h"
#include "model/structure.h"

namespace emtb {

/// The terminal voltage that drives the motor: what the known driver makes of the reference, and what the measurement
/// adds to it, averaged for as long as that stays the same. Where it does not, the driver is not as known, and the
/// measurement counts as it is.
class LiveVoltage {
 public:
  LiveVoltage(const ModelStructure& structure, bool has_driver)
      : driver_(structure.driver), known_(has_driver && structure.input == Signal::u_ref) {
    for (const std::size_t effect : structure.effects) {
      known_ = known_ && effect_catalogue()[effect].stage != Stage::driver;
    }
  }

  /// A run begins. @param e_a [V] as measured
  void start(double u_ref, double e_a) {
    e_ = std::isfinite(e_a) ? e_a : target(u_ref);
    u_ref_ = u_ref;
    added_.forget();
  }

  /// @param h [s] since the tick before. @param u_ref [V] from now on. @param e_a [V] as measured, NaN: not.
  /// @return [V] NaN: not known
  double next(double h, double u_ref, double e_a) {
    if (!known_) return e_a;
    e_ = slew(e_, target(u_ref_), driver_.rise, driver_.fall, h).end;
    u_ref_ = u_ref;
    if (!std::isfinite(e_a)) return added_.changing() ? e_a : e_ + added_.mean();
    return e_ + added_.next(e_a - e_);
  }

 private:
  double target(double u_ref) const { return std::clamp(driver_.gain * u_ref, driver_.min, driver_.max); }

  DriverModel driver_;
  bool known_;
  double e_ = 0, u_ref_ = 0;
  SteadyMean added_;  ///< [V] by the measurement
};

}  // namespace emtb
