#include "drivers/simulated/remote.h"

#include <algorithm>
#include <cmath>

#include "hal/error.h"

namespace emtb::simulated {

RemoteInput::RemoteInput(const std::string& process, std::string name, const std::vector<Signal>& wanted,
                         std::shared_ptr<const Clock> clock)
    : name_(std::move(name)),
      memory_(PlantMemory::open(process)),
      port_(memory_->device(name_)),
      clock_(std::move(clock)) {
  if (port_ != nullptr) {
    for (std::uint64_t c = 0; c < port_->channel_count; ++c) {
      const PlantPort::ChannelText& text = port_->channels[c];
      channels_.push_back({.signal = static_cast<Signal>(text.signal),
                           .period = text.period,
                           .window = text.window,
                           .lsb = text.lsb,
                           .source = text.source.data(),
                           .low = text.low,
                           .high = text.high,
                           .endless = text.endless != 0});
    }
  }
  if (!std::ranges::equal(channels_, wanted, {}, &Channel::signal)) {
    throw DeviceError(name_ + ": the plant " + process + " was started with another bench file. Start it again");
  }
}

void RemoteInput::start() {
  if (!memory_->alive(clock_->now())) {
    throw DeviceError(name_ + ": the plant's process does not answer any more. Start emtb-plant again");
  }
  next_ = port_->head.load(std::memory_order_acquire);
  seen_.fill(false);
}

Readings RemoteInput::read(std::span<Reading> out) noexcept {
  Readings readings;
  const std::uint64_t head = port_->head.load(std::memory_order_acquire);
  // A reader that was away for longer than the ring goes on with the newer half: sequence numbers tell the gap.
  if (head - next_ > PlantPort::ring_size) next_ = head - PlantPort::ring_size / 2;
  for (; next_ < head && readings.count < out.size(); ++next_) {
    const auto reading = port_->reading(next_);
    if (!reading || index(reading->signal) >= signal_count) continue;
    const std::size_t of = index(reading->signal);
    if (!seen_[of]) base_[of] = reading->sequence;
    seen_[of] = true;
    out[readings.count] = *reading;
    out[readings.count++].sequence -= base_[of];
  }
  if (memory_->ended.load(std::memory_order_relaxed) != 0) readings.fault = Fault::device_lost;
  return readings;
}

std::optional<ClockEstimate> RemoteInput::own_clock() const noexcept {
  if (port_->has_clock == 0) return {};
  return port_->clock.load();
}

RemoteOutput::RemoteOutput(const std::string& process, Limits limits, std::shared_ptr<const Clock> clock)
    : memory_(PlantMemory::open(process)), limits_(limits), clock_(std::move(clock)) {
  make_safe();
}

Fault RemoteOutput::set(double volts) noexcept {
  if (!std::isfinite(volts)) {
    make_safe();
    return Fault::non_finite;
  }
  memory_->reference = std::clamp(volts, limits_.min, limits_.max);
  return memory_->alive(clock_->now()) ? Fault::none : Fault::device_lost;
}

Fault RemoteOutput::make_safe() noexcept {
  memory_->reference = limits_.safe;
  return memory_->alive(clock_->now()) ? Fault::none : Fault::device_lost;
}

}  // namespace emtb::simulated
