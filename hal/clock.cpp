#include "hal/clock.h"

#include <cerrno>
#include <cmath>
#include <ctime>

namespace emtb {

double MonotonicClock::now() const noexcept {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

void MonotonicClock::sleep_until(double t) noexcept {
  const double whole = std::floor(t);
  const timespec until{static_cast<time_t>(whole), static_cast<long>((t - whole) * 1e9)};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
  }
}

}  // namespace emtb
