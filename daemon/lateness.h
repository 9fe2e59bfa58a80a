#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace emtb {

/// How late the loop woke, as a histogram: one thread adds, any thread asks.
///
/// Eight bins an octave from 1 us up: a percentile is right to 13 %, whatever the tail.
class Lateness {
 public:
  /// @param seconds after the deadline
  void add(double seconds) noexcept {
    const auto us = static_cast<std::uint64_t>(std::clamp(seconds * 1e6, 0.0, 1e12));
    auto& bin = bins_[bin_of(us)];
    bin.store(bin.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    if (seconds > max_.load(std::memory_order_relaxed)) max_.store(seconds, std::memory_order_relaxed);
  }

  /// @param share 0.99 for the 99th percentile. @return [s], the upper edge of the bin; 0 where nothing was added
  double percentile(double share) const noexcept {
    std::uint64_t total = 0;
    for (const auto& bin : bins_) total += bin.load(std::memory_order_relaxed);
    std::uint64_t below = 0;
    for (std::size_t i = 0; i < bins_.size() && total > 0; ++i) {
      below += bins_[i].load(std::memory_order_relaxed);
      if (static_cast<double>(below) >= share * static_cast<double>(total)) return std::min(upper_edge(i), max());
    }
    return 0;
  }

  double max() const noexcept { return max_.load(std::memory_order_relaxed); }  ///< [s]

 private:
  static std::size_t bin_of(std::uint64_t us) noexcept {
    if (us < 8) return us;
    const int octave = std::bit_width(us) - 1;  // >= 3
    const auto eighth = (us >> (octave - 3)) & 7;
    return std::min<std::size_t>(static_cast<std::size_t>(octave - 2) * 8 + eighth, 191);
  }
  static double upper_edge(std::size_t bin) noexcept {  // [s]
    if (bin < 8) return static_cast<double>(bin + 1) * 1e-6;
    const std::size_t shift = bin / 8 - 1;
    return static_cast<double>((bin % 8 + 9) << shift) * 1e-6;
  }

  std::array<std::atomic<std::uint64_t>, 192> bins_{};  // to 2^26 us: a minute
  std::atomic<double> max_{0};
};

}  // namespace emtb
