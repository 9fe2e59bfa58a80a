#pragma once

#include <cstddef>

namespace emtb {

/// Counts what this thread takes from the heap by `new` while it lives. heap_guard.cpp replaces the operators of the
/// test program.
class HeapGuard {
 public:
  HeapGuard() noexcept;
  ~HeapGuard();
  std::size_t count() const noexcept;
};

}  // namespace emtb
