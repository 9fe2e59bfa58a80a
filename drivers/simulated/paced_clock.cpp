#include "drivers/simulated/paced_clock.h"

#include <algorithm>
#include <cmath>

namespace emtb::simulated {
namespace {

/// [s] of machine time: a change of pace is noticed within this, however long the sleep.
constexpr double longest_nap = 0.01;

double valid(double pace) noexcept { return std::isfinite(pace) && pace >= 0 ? pace : 1; }

}  // namespace

PacedClock::PacedClock(double pace)
    : base_(machine_.now()), origin_(base_.load()), pace_(valid(pace)), stepped_(base_.load()) {}

PacedClock::Course PacedClock::course() const noexcept {
  while (true) {
    const std::uint64_t before = version_.load();
    // The machine's time is read inside, too: a course that has been replaced must not be followed any further.
    const Course course{
        .base = base_.load(), .origin = origin_.load(), .pace = pace_.load(), .machine = machine_.now()};
    if (before % 2 == 0 && version_.load() == before) return course;
  }
}

double PacedClock::now() const noexcept { return std::max(course().running(), stepped_.load()); }

double PacedClock::pace() const noexcept { return pace_.load(); }

void PacedClock::set_pace(double pace) noexcept {
  const std::lock_guard lock(writer_);
  ++version_;  // from here on readers wait, so that none has seen a later time than the one taken now
  const double machine = machine_.now();
  base_ = std::max(base_ + pace_ * (machine - origin_), stepped_.load());
  origin_ = machine;
  pace_ = valid(pace);
  ++version_;
}

void PacedClock::sleep_until(double t) noexcept {
  while (true) {
    const double left = t - now();
    if (!(left > 0)) return;
    const Course c = course();
    if (c.pace == 0) {
      double least = stepped_.load();
      while (least < t && !stepped_.compare_exchange_weak(least, t)) {
      }
      return;
    }
    // An absolute time of the machine's clock, so that nothing adds up over the ticks.
    machine_.sleep_until(std::min(c.origin + (t - c.base) / c.pace, machine_.now() + longest_nap));
  }
}

}  // namespace emtb::simulated
