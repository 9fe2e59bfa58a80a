#include "drivers/replay/play_clock.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace emtb::replay {

PlayClock::PlayClock(std::vector<double> ticks, double period, double pace)
    : ticks_(std::move(ticks)), period_(period), pace_(pace), base_(-period), origin_(machine_.now()) {}

double PlayClock::flowing() const noexcept { return base_ + machine_.now() - origin_; }

double PlayClock::now() const noexcept { return playing_ ? stepped_.load() : flowing(); }

void PlayClock::restart_at(double t) noexcept {
  base_ = t;
  origin_ = machine_.now();
}

void PlayClock::rewind() noexcept { restart_at(-period_); }

void PlayClock::play(bool on) noexcept {
  if (on == playing_) return;
  const double from = on ? -period_ : stepped_.load();
  restart_at(from);
  stepped_ = from;
  next_ = 0;
  playing_ = on;
}

double PlayClock::horizon() const noexcept {
  if (next_ >= ticks_.size()) return std::numeric_limits<double>::infinity();
  return std::min(ticks_[next_], stepped_.load() + period_);  // in a gap nothing was read
}

void PlayClock::sleep_until(double t) noexcept {
  if (!playing_) return machine_.sleep_until(origin_ + t - base_);
  const double wake = next_ < ticks_.size() ? ticks_[next_++] : std::max(t, stepped_.load());
  if (std::isfinite(pace_)) machine_.sleep_until(origin_ + (wake - base_) / pace_);
  stepped_ = wake;
}

}  // namespace emtb::replay
