#pragma once

#include <cstddef>
#include <vector>

#include "model/dual.h"

namespace emtb {

/// Speed and angle as they are read some time later: straight between the ends of steps, and before the start as the
/// machine moved then.
template <class Scalar>
class LateReading {
 public:
  struct Reading {
    Scalar omega{}, theta{};
  };

  void start() {
    past_.clear();
    seen_ = 0;
  }

  /// What is read at t of what was there at t - delay. @param t [s] never earlier than the last
  Reading read(double t, const Scalar& delay, const Reading& now) {
    if (!past_.empty() && t <= past_.back().t) past_.clear();  // the start, once more
    past_.push_back({t, now});
    const double at = t - value_of(delay);
    if (past_.size() == 1 || at < past_.front().t) {
      const Reading& first = past_.front().reading;
      return {first.omega, first.theta + first.omega * ((t - past_.front().t) - delay)};
    }
    while (seen_ + 2 < past_.size() && past_[seen_ + 1].t <= at) ++seen_;
    const Past &a = past_[seen_], &b = past_[seen_ + 1];
    const Scalar share = ((t - a.t) - delay) / (b.t - a.t);
    const Reading reading{a.reading.omega + (b.reading.omega - a.reading.omega) * share,
                          a.reading.theta + (b.reading.theta - a.reading.theta) * share};
    forget();
    return reading;
  }

 private:
  /// A machine that runs all day would fill the memory.
  void forget() {
    constexpr std::size_t many = 4096;
    if (seen_ < many) return;
    past_.erase(past_.begin(), past_.begin() + static_cast<std::ptrdiff_t>(seen_));
    seen_ = 0;
  }

  struct Past {
    double t;
    Reading reading;
  };
  std::vector<Past> past_;
  std::size_t seen_ = 0;  ///< the last whose next is not read yet
};

}  // namespace emtb
