#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <exception>
#include <functional>
#include <mutex>
#include <numeric>
#include <thread>
#include <vector>

namespace emtb {

/// While one of these lives, parallel_for() on this thread takes no other: for who shares out larger work by himself.
class OneThreadHere {
 public:
  OneThreadHere() { ++count(); }
  ~OneThreadHere() { --count(); }
  OneThreadHere(const OneThreadHere&) = delete;
  OneThreadHere& operator=(const OneThreadHere&) = delete;

  static bool on() { return count() > 0; }

 private:
  static int& count() {
    thread_local int here = 0;
    return here;
  }
};

/// Calls f(0) ... f(n - 1), shared out over the machine's cores. The first exception is passed on.
template <class Function>
void parallel_for(std::size_t n, const Function& f) {
  const std::size_t cores = OneThreadHere::on() ? 1 : std::max(1U, std::thread::hardware_concurrency());
  const std::size_t workers = std::min(n, cores);
  if (workers <= 1) {
    for (std::size_t i = 0; i < n; ++i) f(i);
    return;
  }
  std::atomic<std::size_t> next{0};
  std::exception_ptr failure;
  std::mutex failure_mutex;
  const auto work = [&] {
    for (std::size_t i = next++; i < n; i = next++) {
      try {
        f(i);
      } catch (...) {
        const std::lock_guard lock(failure_mutex);
        if (!failure) failure = std::current_exception();
      }
    }
  };
  std::vector<std::jthread> threads;
  for (std::size_t w = 1; w < workers; ++w) threads.emplace_back(work);
  work();
  threads.clear();
  if (failure) std::rethrow_exception(failure);
}

/// The same, what takes longest first: the last to be taken then keeps one core the least.
/// @param length_of the work of f(i), in any unit
template <class Function, class Length>
void parallel_for(std::size_t n, const Function& f, const Length& length_of) {
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, std::greater{}, length_of);
  parallel_for(n, [&](std::size_t k) { f(order[k]); });
}

/// Calls f(0) ... f(n - 1), each of them on one core: for larger work that would share itself out. A single one may.
template <class Function>
void each_on_a_core(std::size_t n, const Function& f) {
  if (n == 1) return f(0);
  parallel_for(n, [&](std::size_t i) {
    const OneThreadHere alone;
    f(i);
  });
}

/// Calls some functions, shared out likewise.
template <class... Functions>
void at_once(const Functions&... functions) {
  const std::array<std::function<void()>, sizeof...(functions)> all{functions...};
  parallel_for(all.size(), [&](std::size_t i) { all[i](); });
}

/// Calls f(i) for the place of each item, the longest items first.
/// @param items have a length(), to which the work is in proportion
template <class Items, class Function>
requires requires(const Items& items) { items[0].length(); }
void parallel_for(const Items& items, const Function& f) {
  parallel_for(items.size(), f, [&](std::size_t i) { return items[i].length(); });
}

}  // namespace emtb
