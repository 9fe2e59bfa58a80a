#include "drivers/handover.h"

#include <algorithm>
#include <cmath>

namespace emtb {
namespace {

constexpr double late = 1.5;  // periods; meters keep theirs to some 10 %

}  // namespace

Handover::Handover(std::span<const Channel> channels, std::size_t capacity) : queue_(capacity) {
  for (const Channel& channel : channels) counters_[index(channel.signal)].period = channel.period;
}

void Handover::deliver(Signal signal, double time, double value) noexcept {
  Counter& counter = counters_[index(signal)];
  const double periods = counter.period > 0 ? (time - counter.last) / counter.period : 1;
  if (counter.next > 0 && periods > late) counter.next += static_cast<std::uint64_t>(std::lround(periods)) - 1;
  counter.last = time;
  queue_.push({.signal = signal, .time = time, .value = value, .sequence = counter.next});
  counter.published = ++counter.next;
}

void Handover::raise(Fault fault) noexcept {
  standing_ = fault;
  unseen_ = fault;
}

void Handover::restart() noexcept {
  queue_.consume_all([](const Reading&) {});
  for (Counter& counter : counters_) counter.base = counter.published;
  unseen_ = Fault::none;
}

Readings Handover::take(std::span<Reading> out) noexcept {
  Readings readings;
  Reading reading;
  while (readings.count < out.size() && queue_.pop(reading)) {
    const std::uint64_t base = counters_[index(reading.signal)].base;
    if (reading.sequence < base) continue;  // delivered while restart() was at work
    reading.sequence -= base;
    out[readings.count++] = reading;
  }
  const Fault unseen = unseen_.exchange(Fault::none);
  const Fault standing = standing_;
  readings.fault = standing != Fault::none ? standing : unseen;
  return readings;
}

}  // namespace emtb
