#pragma once

#include <array>
#include <atomic>
#include <boost/lockfree/spsc_queue.hpp>
#include <cstddef>
#include <cstdint>
#include <span>

#include "hal/input_device.h"

namespace emtb {

/// From a device's own thread to the loop: readings through a queue without locks, and the fault that stands.
///
/// A reading that comes after more than one and a half periods leaves a gap in the sequence numbers, as long as the
/// readings that the period would have given. Where nobody reads, new readings are lost and leave a gap, too.
class Handover {
 public:
  /// @param channels what the device measures; looked at here only
  /// @param capacity [readings] that wait for the loop at most
  explicit Handover(std::span<const Channel> channels, std::size_t capacity = 256);

  /// Of the device's thread. @param time [s] on the loop's clock, later than the one before
  void deliver(Signal signal, double time, double value) noexcept;

  /// Of the device's thread: from now on every take() says so, until clear(), and at least one does.
  void raise(Fault fault) noexcept;
  void clear() noexcept { standing_ = Fault::none; }

  /// Of the loop's thread: empties the queue, restarts sequence numbers, forgets a fault that no longer stands.
  void restart() noexcept;
  /// Of the loop's thread: what InputDevice::read() has to give.
  Readings take(std::span<Reading> out) noexcept;

 private:
  struct Counter {
    double period = 0;       ///< [s]
    double last = 0;         ///< [s] time of the reading before
    std::uint64_t next = 0;  ///< of the device's thread
    std::uint64_t base = 0;  ///< of the loop's thread: the number that counts as 0
    std::atomic<std::uint64_t> published = 0;
  };

  std::array<Counter, signal_count> counters_;
  boost::lockfree::spsc_queue<Reading> queue_;
  std::atomic<Fault> standing_ = Fault::none;
  std::atomic<Fault> unseen_ = Fault::none;
};

}  // namespace emtb
