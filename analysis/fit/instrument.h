#pragma once

#include <cstddef>
#include <vector>

#include "analysis/record/observation.h"

namespace emtb {

/// The instrument behind an observation: what it would have read of the simulated signal, formed as that comes.
template <class Scalar>
class Instrument {
 public:
  explicit Instrument(const Observation& o)
      : o_(o),
        averages_(o.first != o.last),
        at_once_(!averages_ && o.functional == Functional::instant && o.late <= 0) {
    if (averages_) integral_at_first_.resize(o.size());  // of a slope: the sum so far
  }

  const Observation& observation() const { return o_; }
  bool at_once() const { return at_once_; }  ///< its readings are the signal's values at one grid point each

  /// @param take called with the number of each reading that ends at grid point k, and its prediction
  template <class Take>
  void see(std::size_t k, const Scalar& now, const Take& take) {
    if (at_once_) {
      for (; done_ < o_.last.size() && o_.last[done_] == k; ++done_) take(done_, now);
      return;
    }
    const Scalar x = o_.late > 0 && k > 0 ? now + o_.late * (sample_before_ - now) : now;
    sample_before_ = now;
    if (o_.functional == Functional::slope) {
      sum_up(k, x, take);
      return;
    }
    if (averages_ && o_.functional != Functional::increment) {
      if (k > 0) integral_ += 0.5 * (before_ + x);
      before_ = x;
      for (; begun_ < o_.size() && o_.first[begun_] == k; ++begun_) integral_at_first_[begun_] = integral_;
    }
    if (o_.functional == Functional::increment) {
      for (; begun_ < o_.size() && o_.first[begun_] == k; ++begun_) integral_at_first_[begun_] = x;
      for (; done_ < o_.size() && o_.last[done_] == k; ++done_) take(done_, x - integral_at_first_[done_]);
      return;
    }
    for (; done_ < o_.size() && o_.last[done_] == k; ++done_) {
      const std::size_t over = k - o_.first[done_];
      if (over == 0) {
        take(done_, x);
      } else {
        take(done_, (integral_ - integral_at_first_[done_]) * (1.0 / static_cast<double>(over)));
      }
    }
  }

 private:
  /// The lines overlap: a value is in two or three of them.
  template <class Take>
  void sum_up(std::size_t k, const Scalar& x, const Take& take) {
    while (begun_ < o_.size() && o_.first[begun_] <= k) ++begun_;
    for (std::size_t i = done_; i < begun_; ++i) {
      integral_at_first_[i] += o_.weight[o_.weight_from[i] + k - o_.first[i]] * x;
    }
    for (; done_ < o_.size() && o_.last[done_] == k; ++done_) take(done_, integral_at_first_[done_]);
  }

  const Observation& o_;
  bool averages_;
  bool at_once_;                      ///< a reading is the signal's value at one grid point
  std::size_t begun_ = 0, done_ = 0;  ///< readings whose first and whose last grid point has passed
  Scalar integral_{}, before_{};
  Scalar sample_before_{};                 ///< the signal at the grid point before: what a late instrument still reads
  std::vector<Scalar> integral_at_first_;  ///< or of an increment, the signal itself
};

}  // namespace emtb
