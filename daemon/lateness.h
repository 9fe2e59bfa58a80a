#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace emtb {

/// How often something lasted how long: eight bins an octave from 1 us up, so that a percentile is right to 13 %,
/// whatever the tail.
struct Durations {
  static constexpr std::size_t bins = 192;  // to 2^26 us: a minute

  std::array<std::uint64_t, bins> count{};
  double max = 0;  ///< [s]

  static std::size_t bin_of(std::uint64_t us) noexcept {
    if (us < 8) return us;
    const int octave = std::bit_width(us) - 1;  // >= 3
    const auto eighth = (us >> (octave - 3)) & 7;
    return std::min<std::size_t>(static_cast<std::size_t>(octave - 2) * 8 + eighth, bins - 1);
  }
  static double upper_edge(std::size_t bin) noexcept {  // [s]
    if (bin < 8) return static_cast<double>(bin + 1) * 1e-6;
    const std::size_t shift = bin / 8 - 1;
    return static_cast<double>((bin % 8 + 9) << shift) * 1e-6;
  }

  std::uint64_t total() const noexcept {
    std::uint64_t sum = 0;
    for (const std::uint64_t n : count) sum += n;
    return sum;
  }

  /// @param share 0.99 for the 99th percentile. @return [s], the upper edge of the bin; 0 where nothing was added
  double percentile(double share) const noexcept {
    const std::uint64_t all = total();
    std::uint64_t below = 0;
    for (std::size_t i = 0; i < bins && all > 0; ++i) {
      below += count[i];
      if (static_cast<double>(below) >= share * static_cast<double>(all)) return std::min(upper_edge(i), max);
    }
    return 0;
  }

  /// What came since `before`. The maximum is known to the bin.
  Durations since(const Durations& before) const noexcept {
    Durations later;
    for (std::size_t i = 0; i < bins; ++i) {
      later.count[i] = count[i] - before.count[i];
      if (later.count[i] > 0) later.max = std::min(upper_edge(i), max);
    }
    return later;
  }
};

/// Durations as they come: one thread adds, any thread asks.
class Lateness {
 public:
  void add(double seconds) noexcept {
    const auto us = static_cast<std::uint64_t>(std::clamp(seconds * 1e6, 0.0, 1e12));
    auto& bin = bins_[Durations::bin_of(us)];
    bin.store(bin.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    if (seconds > max_.load(std::memory_order_relaxed)) max_.store(seconds, std::memory_order_relaxed);
  }

  /// As it stands now.
  Durations durations() const noexcept {
    Durations now{.max = max_.load(std::memory_order_relaxed)};
    for (std::size_t i = 0; i < Durations::bins; ++i) now.count[i] = bins_[i].load(std::memory_order_relaxed);
    return now;
  }

 private:
  std::array<std::atomic<std::uint64_t>, Durations::bins> bins_{};
  std::atomic<double> max_{0};
};

}  // namespace emtb
