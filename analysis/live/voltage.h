#pragma once

#include <algorithm>
#include <cmath>

#include "hal/signal.h"
#include "model/catalogue.h"
#include "model/slew.h"
#include "model/structure.h"

namespace emtb {

/// A measured input without its noise, for as long as it stays the same: its mean. Where it changes, it counts as it
/// is.
///
/// Noise of a measured input is in the sensitivities as well as in the residuals, and their product does not average
/// away: it would pull R_a up by a part of noise²/(R_a i)², and let a motor under a measured load seem heavier (errors
/// in variables).
class SteadyMean {
 public:
  double next(double x) {
    // Noise from neighbours, which know nothing of slow errors.
    const double change = x - before_;
    before_ = x;
    changes_ += (change * change - changes_) / std::min(++count_, 1000.0);
    if (changing_ > 0) {  // nothing of it belongs to the mean that follows
      --changing_;
      return x;
    }
    quick_ += (x - quick_) / std::min(++weight_, quick);
    mean_ += (x - mean_) / std::min(weight_, slow);
    const double noise = std::sqrt(0.5 * changes_);
    if (weight_ >= quick && std::abs(quick_ - mean_) > 5 * noise / std::sqrt(2 * quick)) {
      expect_change(static_cast<int>(2 * quick));
      return x;
    }
    return weight_ < quick ? x : mean_;
  }

  /// It is known to change: the next readings count as they are.
  void expect_change(int readings) {
    changing_ = std::max(changing_, readings);
    forget();
  }
  void forget() { weight_ = mean_ = quick_ = 0; }
  bool changing() const { return changing_ > 0; }
  double mean() const { return mean_; }

 private:
  static constexpr double quick = 20, slow = 500;  ///< readings: what shows a change, what averages

  double mean_ = 0, quick_ = 0, weight_ = 0;
  double before_ = 0, changes_ = 0, count_ = 0;  ///< its noise
  int changing_ = 0;                             ///< ticks in which it counts as it is
};

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
