#pragma once

#include <atomic>
#include <boost/lockfree/spsc_queue.hpp>
#include <cstddef>
#include <cstdint>

#include "daemon/ring.h"
#include "hal/signal.h"

namespace emtb {

/// From the loop's thread to the estimator's, past the recorder, whose disk may be slow: one producer, one consumer, no
/// lock, no allocation after construction. What finds it full is lost and counted: neither thread ever waits.
class EstimatorFeed {
 public:
  struct Sample {
    Signal signal{};
    std::uint32_t run = 0;  ///< counted from the first one on
    double t = 0;           ///< [s] from the start of the run
    double value = 0;
    double field_on = 0;  ///< [s] for which the field had been on when its run began
  };

  explicit EstimatorFeed(std::size_t samples) : queue_(samples) {}

  /// What the loop tells; on the loop's thread.
  void take(const Record& record) noexcept {
    if (record.kind == Record::Kind::end) {  // counted here, so that a full queue cannot make one run of two
      ++run_;
      field_on_ = 0;
    }
    if (record.kind == Record::Kind::field) field_on_ = record.value;
    if (record.kind != Record::Kind::sample || !record.signal) return;
    if (!queue_.push({*record.signal, run_, record.t, record.value, field_on_})) {
      lost_.fetch_add(1, std::memory_order_relaxed);
    }
  }

  /// On the estimator's thread. @return false: there is none
  bool pop(Sample& sample) { return queue_.pop(sample); }

  /// Samples, since the beginning. From any thread.
  std::uint64_t lost() const noexcept { return lost_.load(std::memory_order_relaxed); }

 private:
  boost::lockfree::spsc_queue<Sample> queue_;
  std::atomic<std::uint64_t> lost_{0};
  std::uint32_t run_ = 0;  // of the loop's thread
  double field_on_ = 0;    // [s]
};

}  // namespace emtb
