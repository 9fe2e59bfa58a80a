#pragma once

#include <algorithm>
#include <cmath>

#include "hal/signal.h"
#include "model/catalogue.h"
#include "model/slew.h"
#include "model/structure.h"

namespace emtb {

/// The terminal voltage that drives the motor: what the known driver makes of the reference, and what the measurement
/// adds to it, averaged for as long as that stays the same. Where it does not, the driver is not as known, and the
/// measurement counts as it is.
///
/// Noise of a measured input is in the sensitivities as well as in the residuals, and their product does not average
/// away: it would pull R_a up by a part of noise²/(R_a i)² (errors in variables).
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
    forget();
  }

  /// @param h [s] since the tick before. @param u_ref [V] from now on. @param e_a [V] as measured, NaN: not.
  /// @return [V] NaN: not known
  double next(double h, double u_ref, double e_a) {
    if (!known_) return e_a;
    e_ = slew(e_, target(u_ref_), driver_.rise, driver_.fall, h).end;
    u_ref_ = u_ref;
    if (!std::isfinite(e_a)) return trusted_ > 0 ? e_a : e_ + mean_;
    const double added = e_a - e_;
    // Noise from neighbours, which know nothing of slow errors.
    const double change = added - added_;
    added_ = added;
    changes_ += (change * change - changes_) / std::min(++count_, 1000.0);
    quick_ += (added - quick_) / std::min(++weight_, quick);
    mean_ += (added - mean_) / std::min(weight_, slow);
    const double noise = std::sqrt(0.5 * changes_);
    if (weight_ >= quick && std::abs(quick_ - mean_) > 5 * noise / std::sqrt(2 * quick)) {
      trusted_ = static_cast<int>(2 * quick);
      forget();
    }
    if (weight_ < quick) return e_a;
    if (trusted_ > 0) --trusted_;
    return trusted_ > 0 ? e_a : e_ + mean_;
  }

 private:
  static constexpr double quick = 20, slow = 500;  ///< readings: what shows a change, what averages

  double target(double u_ref) const { return std::clamp(driver_.gain * u_ref, driver_.min, driver_.max); }
  void forget() { weight_ = mean_ = quick_ = 0; }

  DriverModel driver_;
  bool known_;
  double e_ = 0, u_ref_ = 0;
  double mean_ = 0, quick_ = 0, weight_ = 0;    ///< [V] of what the measurement adds
  double added_ = 0, changes_ = 0, count_ = 0;  ///< its noise
  int trusted_ = 0;                             ///< ticks in which the measurement counts as it is
};

}  // namespace emtb
