#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "analysis/record/observation.h"
#include "model/lateness.h"
#include "model/simulation.h"

namespace emtb {

/// What belongs to the readings that have begun and not ended: those of an hour are millions, of which a few are under
/// way at a time.
template <class Scalar>
class UnderWay {
 public:
  /// @param i at least `ended`, and no further than one beyond all that were given so far
  void begin(std::size_t i, std::size_t ended, const Scalar& value) {
    if (i - ended >= slots_.size()) grow(i, ended);
    (*this)[i] = value;
  }

  Scalar& operator[](std::size_t i) { return slots_[i & (slots_.size() - 1)]; }

 private:
  void grow(std::size_t i, std::size_t ended) {
    std::vector<Scalar> larger(std::max<std::size_t>(4, 2 * slots_.size()));
    for (std::size_t k = ended; k < i; ++k) larger[k & (larger.size() - 1)] = (*this)[k];
    slots_.swap(larger);
  }

  std::vector<Scalar> slots_;  ///< a power of two of them, used in turn
};

/// The instrument behind an observation: what it would have read of the simulated signal, formed as that comes.
template <class Scalar>
class Instrument {
 public:
  /// @param structure of the equations; where they say how late the instrument is, its own lateness does not count
  Instrument(const Observation& o, const ModelStructure& structure)
      : o_(o),
        late_(o.late > 0 && !says_how_late(structure, o.signal) ? o.late : 0),
        averages_(!o.at_once && o.first != o.last),
        at_once_(!averages_ && (o.at_once || o.functional == Functional::instant) && late_ <= 0) {}

  const Observation& observation() const { return o_; }
  bool at_once() const { return at_once_; }  ///< its readings are the signal's values at one grid point each

  /// @param y the readings at grid point k @param take called with the number of each reading that ends at grid point
  /// k, and its prediction
  template <class Take>
  void see(std::size_t k, const SimulatedReadings<Scalar>& y, const Take& take) {
    const Scalar& now = y.of(o_.simulated());
    if (at_once_) {
      for (; done_ < o_.last.size() && o_.last[done_] == k; ++done_) take(done_, now);
      return;
    }
    if (late_ > 0 && !o_.late_by_row.empty()) late_ = o_.late_by_row[k];
    if (k == 0 && first_is_of_before_the_run(now)) {
      first_waits_ = true;
      sample_before_ = now;
      return;
    }
    if (first_waits_) take(done_++, sample_before_ - late_ * (now - sample_before_));
    first_waits_ = false;
    const Scalar x = late_ > 0 && k > 0 ? before(now, y) : now;
    if (late_ > 0) sample_before_ = now;
    if (o_.functional == Functional::slope) {
      sum_up(k, x, take);
      return;
    }
    if (averages_ && o_.functional != Functional::increment) {
      if (k > 0) integral_ += y.means != nullptr && late_ <= 0 ? mean_of(*y.means, x) : 0.5 * (before_ + x);
      before_ = x;
      for (; begun_ < o_.size() && o_.first[begun_] == k; ++begun_) at_first_.begin(begun_, done_, integral_);
    }
    if (o_.functional == Functional::increment) {
      for (; begun_ < o_.size() && o_.first[begun_] == k; ++begun_) at_first_.begin(begun_, done_, x);
      for (; done_ < o_.size() && o_.last[done_] == k; ++done_) take(done_, x - at_first_[done_]);
      return;
    }
    for (; done_ < o_.size() && o_.last[done_] == k; ++done_) {
      const std::size_t over = k - o_.first[done_];
      if (over == 0) {
        take(done_, x);
      } else {
        take(done_, (integral_ - at_first_[done_]) * (1.0 / static_cast<double>(over)));
      }
    }
  }

 private:
  /// A shaft that turns when a run begins turned before: its late reading goes on straight from what comes.
  bool first_is_of_before_the_run(const Scalar& first) const {
    const bool of_the_shaft = o_.functional == Functional::instant && o_.simulated() == Signal::omega;
    return late_ > 0 && of_the_shaft && o_.size() > 0 && o_.last.front() == 0 && value_of(first) != 0;
  }

  /// Between the last two grid points, of what is not straight there.
  Scalar mean_of(const MeanReadings<Scalar>& means, const Scalar& now) const {
    switch (o_.simulated()) {
      case Signal::e_a:
        return means.e_a;
      case Signal::i_a:
        return means.i_a;
      case Signal::omega:
        return means.omega;
      default:
        return 0.5 * (before_ + now);
    }
  }

  /// The signal a part of a sample before a grid point: straight between the readings, but for what goes with the
  /// shaft, and for a voltage or a current while the driver moves.
  Scalar before(const Scalar& now, const SimulatedReadings<Scalar>& y) const {
    const bool current = o_.signal == Signal::i_a;
    const bool moves = y.move != nullptr && (current || o_.signal == Signal::e_a);
    Scalar x = moves ? while_driver_moves(now, *y.move, current) : now - late_ * (now - sample_before_);
    if (y.course == nullptr) return x;
    if (current) x += y.course->current_bow(1 - late_);
    if (o_.simulated() == Signal::omega) x += y.course->speed_bow(1 - late_);
    if (o_.simulated() == Signal::theta) x += y.course->angle_bow(1 - late_);
    return x;
  }

  Scalar while_driver_moves(const Scalar& now, const DriverMove<Scalar>& move, bool current) const {
    const double at = 1 - late_;
    Scalar begun = sample_before_, done = now;
    if (current) {  // the speed takes from it
      begun -= std::min(at, move.from) * move.before;
      done += (1 - std::max(at, move.until)) * move.after;
    }
    if (at >= move.until) return done;
    if (at <= move.from) return begun;
    return begun + (done - begun) * ((at - move.from) / (move.until - move.from));
  }

  /// The lines overlap: a value is in two or three of them.
  template <class Take>
  void sum_up(std::size_t k, const Scalar& x, const Take& take) {
    for (; begun_ < o_.size() && o_.first[begun_] <= k; ++begun_) at_first_.begin(begun_, done_, Scalar{});
    for (std::size_t i = done_; i < begun_; ++i) {
      at_first_[i] += o_.weight[o_.weight_from[i] + k - o_.first[i]] * x;
    }
    for (; done_ < o_.size() && o_.last[done_] == k; ++done_) take(done_, at_first_[done_]);
  }

  const Observation& o_;
  double late_;  ///< [samples], of a row where they differ
  bool averages_;
  bool at_once_;                      ///< a reading is the signal's value at one grid point
  bool first_waits_ = false;          ///< for the grid point after it
  std::size_t begun_ = 0, done_ = 0;  ///< readings whose first and whose last grid point has passed
  Scalar integral_{}, before_{};
  Scalar sample_before_{};     ///< the signal at the grid point before, for a late instrument
  UnderWay<Scalar> at_first_;  ///< the integral when a reading begins; of an increment, the signal; of a slope, its sum
};

}  // namespace emtb
