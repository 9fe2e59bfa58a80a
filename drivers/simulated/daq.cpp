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
      return plant.ammeter();
    case Signal::omega:
      return plant.tacho();
    case Signal::theta:
      return plant.encoder();
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

Converters::Converters(const std::string& name, std::uint64_t seed, std::vector<DaqChannel> channels, double period)
    : seed_(seed), settings_(std::move(channels)) {
  for (const DaqChannel& channel : settings_) {
    const std::string signal(info(channel.signal).name);
    if (!measurable(channel.signal)) {
      throw ConfigError(name + ": the simulated plant has no " + signal +
                        ". It has u_ref, e_a, i_a, omega, theta, torque");
    }
    const DaqChannel::Line line = channel.line();
    Channel description{
        .signal = channel.signal,
        .period = period,
        .window = 0,
        .lsb = channel.lsb() * std::abs(line.scale / channel.nominal().scale),
        .source = name + " " + signal + " (simulated)",
        .conversion = {.scale = line.scale, .offset = line.zero, .from_file = true, .offset_key = "zero"}};
    if (channel.bits > 0) {
      const double a = channel.reading(channel.low);
      const double b = channel.reading(channel.high - channel.lsb());
      description.low = std::min(a, b);
      description.high = std::max(a, b);
    }
    noise_.emplace_back(channel.noise, channel.correlation, stream(seed_, 0, description.source));
    descriptions_.push_back(std::move(description));
  }
}

void Converters::start() {
  ++recordings_;
  for (std::size_t c = 0; c < settings_.size(); ++c) {
    noise_[c] =
        Noise(settings_[c].noise, settings_[c].correlation, stream(seed_, recordings_, descriptions_[c].source));
  }
}

void Converters::read(const World& world, const Plant& plant, double t, std::uint64_t sequence,
                      std::span<Reading> out) noexcept {
  for (std::size_t c = 0; c < settings_.size(); ++c) {
    const DaqChannel& channel = settings_[c];
    const double there = world.held(channel.signal).value_or(truth(channel.signal, plant, world.reference()));
    const double value = quantise(channel, channel.gain * there + channel.offset + noise_[c].next());
    out[c] = {.signal = channel.signal, .time = t, .value = channel.reading(value), .sequence = sequence};
  }
}

Daq::Daq(const std::string& name, std::shared_ptr<World> world, std::vector<DaqChannel> channels, double period)
    : world_(std::move(world)),
      converters_(name, world_->seed(), std::move(channels), period),
      sample_(converters_.size()),
      next_(sample_.size()) {}

void Daq::start() {
  converters_.start();
  sequence_ = 0;
  next_ = sample_.size();
  world_->restart();
}

void Daq::sample() noexcept {
  world_->look(
      [this](double t, const Plant& plant, double) { converters_.read(*world_, plant, t, sequence_, sample_); });
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
