#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

namespace emtb {

/// How many rows of some records have been simulated, a row with four derivatives as one: the work of a search, which
/// is the same on any machine, under any load and with any number of threads, as no time is.
class Effort {
 public:
  void add(std::size_t rows, std::size_t derivatives) {
    const std::size_t passes = derivatives > 4 ? (derivatives + 3) / 4 : 1;
    rows_.fetch_add(rows * passes, std::memory_order_relaxed);
  }

  std::uint64_t rows() const { return rows_.load(std::memory_order_relaxed); }

 private:
  std::atomic<std::uint64_t> rows_{0};
};

}  // namespace emtb
