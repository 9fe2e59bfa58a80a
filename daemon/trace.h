#pragma once

#include <atomic>
#include <boost/lockfree/spsc_queue.hpp>
#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "hal/input_device.h"
#include "hal/signal.h"

namespace emtb {

/// What has been measured, armed or not, for those who watch: the newest samples, and the last hour as smallest and
/// largest of small bins.
///
/// The loop pushes each sample into a queue and never waits; a thread of the daemon's empties it (work()), the server's
/// thread asks. All memory is taken at the beginning. What finds the queue full, or is gone before a follower came for
/// it, is counted as dropped.
class Trace {
 public:
  static constexpr double fine_bin = 0.01, coarse_bin = 0.1;           ///< [s] of the history
  static constexpr std::size_t fine_bins = 6100, coarse_bins = 36100;  ///< a minute and an hour
  static constexpr std::size_t most_at_once = 4000;                    ///< values in one block
  static constexpr std::size_t largest_history = 20000;                ///< values: an answer stays below 200 kB

  /// @param channels of the bench; u_ref comes besides @param rate [Hz] of the loop
  Trace(const std::vector<Channel>& channels, double rate);

  /// On the loop's thread. @param at [s] on the loop's clock
  void take(Signal signal, double at, double value) noexcept {
    if (!queue_.push({signal, at, value})) lost_.fetch_add(1, std::memory_order_relaxed);
  }

  /// On a thread of its own, again and again. @return whether more may be waiting
  bool work();

  /// Samples from now on, for one client. @param bin [s]; 0: each sample
  void follow(std::uint64_t client, double bin);
  void forget(std::uint64_t client);

  /// What came since the last call, as `samples` is sent; empty: nothing
  std::string block(std::uint64_t client);

  /// The last seconds, in at most so many bins.
  nlohmann::json history(double last, std::size_t points) const;

 private:
  struct Sample {
    Signal signal{};
    double at = 0, value = 0;
  };
  struct Bin {
    std::int64_t index = 0;
    double min = 0, max = 0, last = 0;
    void take(double value) noexcept;
  };
  /// A ring of bins, newest last.
  struct Bins {
    Bins(double bin, std::size_t size) : width(bin), ring(size) {}
    void take(double t, double value) noexcept;
    double width;
    std::vector<Bin> ring;
    std::uint64_t count = 0;  // ever begun
  };
  struct Track {
    explicit Track(std::size_t samples) : ring(samples), fine(fine_bin, fine_bins), coarse(coarse_bin, coarse_bins) {}
    std::vector<Sample> ring;
    std::uint64_t count = 0;  // ever taken
    Bins fine, coarse;
  };
  struct Cursor {  // of one follower in one track
    std::uint64_t next = 0;
    bool open = false;
    Bin bin;
  };
  struct Follower {
    double bin = 0;
    std::uint64_t dropped = 0, lost = 0;
    std::map<Signal, Cursor> at;
  };

  void begin_anew();
  nlohmann::json single(Follower& f, Signal signal, Track& track, std::size_t& room) const;
  nlohmann::json binned(Follower& f, Signal signal, Track& track, std::size_t& room) const;
  void catch_up(Follower& f, Cursor& cursor, const Track& track) const;

  boost::lockfree::spsc_queue<Sample> queue_;
  std::atomic<std::uint64_t> lost_{0};
  mutable std::mutex mutex_;  // of the two threads that are not the loop's
  std::map<Signal, Track> tracks_;
  std::map<std::uint64_t, Follower> followers_;
  double now_ = 0;  // [s] of the newest sample
};

}  // namespace emtb
