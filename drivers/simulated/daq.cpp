#include "drivers/simulated/daq.h"

#include <algorithm>
#include <cmath>

#include "hal/error.h"

namespace emtb::simulated {
namespace {

double truth(Signal signal, const Plant& plant, double reference) noexcept {
  switch (signal) {
    case Signal::u_ref:
      return reference;
    case Signal::e_a:
      return plant.e_a();
    case Signal::i_a:
      return plant.i_a();
    case Signal::omega:
      return plant.tacho();
    case Signal::theta:
      return plant.theta();
    case Signal::torque:
      return plant.gauge();
    default:
      return 0;
  }
}

}  // namespace

bool measurable(Signal signal) noexcept {
  return signal != Signal::i_f && signal != Signal::temperature && signal != Signal::armature_open;
}

double quantise(const DaqChannel& channel, double value) noexcept {
  if (channel.bits <= 0) return value;
  const double code = std::round((value - channel.low) / channel.lsb());
  const double full = static_cast<double>((1LL << channel.bits) - 1);
  const double half = static_cast<double>(1LL << (channel.bits - 1));
  // Counted from the middle, so that zero is exactly zero.
  return (channel.low + channel.high) / 2 + (std::clamp(code, 0.0, full) - half) * channel.lsb();
}

Daq::Daq(std::string name, std::shared_ptr<World> world, std::vector<DaqChannel> channels, double period)
    : name_(std::move(name)), world_(std::move(world)), settings_(std::move(channels)) {
  for (const DaqChannel& channel : settings_) {
    const std::string signal(info(channel.signal).name);
    if (!measurable(channel.signal)) {
      throw ConfigError(name_ + ": the simulated plant has no " + signal +
                        ". It has u_ref, e_a, i_a, omega, theta, torque");
    }
    const DaqChannel::Line line = channel.line();
    Channel description{
        .signal = channel.signal,
        .period = period,
        .window = 0,
        .lsb = channel.lsb() * std::abs(line.scale / channel.nominal().scale),
        .source = name_ + " " + signal + " (simulated)",
        .conversion = {.scale = line.scale, .offset = line.zero, .from_file = true, .offset_key = "zero"}};
    if (channel.bits > 0) {
      const double a = channel.reading(channel.low);
      const double b = channel.reading(channel.high - channel.lsb());
      description.low = std::min(a, b);
      description.high = std::max(a, b);
    }
    descriptions_.push_back(std::move(description));
  }
  noise_.resize(settings_.size());
  sample_.resize(settings_.size());
  next_ = sample_.size();
  for (std::size_t c = 0; c < settings_.size(); ++c) {
    noise_[c] = Noise(settings_[c].noise, settings_[c].correlation, stream(world_->seed(), 0, descriptions_[c].source));
  }
}

void Daq::start() {
  ++recordings_;
  for (std::size_t c = 0; c < settings_.size(); ++c) {
    noise_[c] = Noise(settings_[c].noise, settings_[c].correlation,
                      stream(world_->seed(), recordings_, descriptions_[c].source));
  }
  sequence_ = 0;
  next_ = sample_.size();
  world_->restart();
}

void Daq::sample() noexcept {
  world_->look([this](double t, const Plant& plant, double reference) {
    for (std::size_t c = 0; c < settings_.size(); ++c) {
      const DaqChannel& channel = settings_[c];
      const double there = world_->held(channel.signal).value_or(truth(channel.signal, plant, reference));
      const double value = quantise(channel, channel.gain * there + channel.offset + noise_[c].next());
      sample_[c] = {.signal = channel.signal, .time = t, .value = channel.reading(value), .sequence = sequence_};
    }
  });
  ++sequence_;
  next_ = 0;
}

Readings Daq::read(std::span<Reading> out) noexcept {
  if (next_ == sample_.size()) sample();
  const std::size_t count = std::min(out.size(), sample_.size() - next_);
  std::copy_n(sample_.begin() + static_cast<std::ptrdiff_t>(next_), count, out.begin());
  next_ += count;
  return {.count = count, .fault = Fault::none};
}

}  // namespace emtb::simulated
