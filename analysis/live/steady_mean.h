#pragma once

#include <algorithm>
#include <cmath>

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
  static constexpr double quick = 20, slow = 500;  ///< readings: what shows a change, what averages; by hand

  double mean_ = 0, quick_ = 0, weight_ = 0;
  double before_ = 0, changes_ = 0, count_ = 0;  ///< its noise
  int changing_ = 0;                             ///< ticks in which it counts as it is
};

}  // namespace emtb
