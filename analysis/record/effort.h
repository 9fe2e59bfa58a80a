#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "model/simulation.h"

namespace emtb {

/// How many steps of some records have been simulated, each once for as many derivatives as one pass carries: the work
/// of a search, which is the same on any machine, under any load and with any number of threads, as no time is.
class Effort {
 public:
  void add(std::size_t steps, std::size_t derivatives) {
    const std::size_t passes =
        std::max<std::size_t>(1, (derivatives + derivatives_per_pass - 1) / derivatives_per_pass);
    steps_.fetch_add(steps * passes, std::memory_order_relaxed);
  }

  std::uint64_t steps() const { return steps_.load(std::memory_order_relaxed); }

 private:
  std::atomic<std::uint64_t> steps_{0};
};

}  // namespace emtb
