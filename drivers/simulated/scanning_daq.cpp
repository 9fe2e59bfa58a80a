#include "drivers/simulated/scanning_daq.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace emtb::simulated {
namespace {

constexpr double reader_away = 2;  // [s] that nobody may read before scans are lost

}  // namespace

ScanningDaq::ScanningDaq(const std::string& name, std::shared_ptr<World> world, std::vector<DaqChannel> channels,
                         double period, const CardClock& clock)
    : world_(std::move(world)),
      converters_(name, world_->seed(), std::move(channels), period),
      period_(period),
      true_period_(period / (1 + clock.ppm * 1e-6)),
      jitter_(clock.jitter),
      block_(static_cast<std::uint64_t>(std::max(1.0, std::round(clock.block / period)))),
      source_(name + " delay"),
      capacity_(static_cast<std::uint64_t>(std::ceil(reader_away / period)) + 2 * block_),
      buffer_(capacity_ * converters_.size()),
      samples_(period) {
  world_->attach(this);
}

ScanningDaq::~ScanningDaq() { world_->detach(this); }

void ScanningDaq::start() {
  converters_.start();
  random_ = SplitMix64(stream(world_->seed(), ++recordings_, source_));
  running_ = true;
  world_->restart();
}

void ScanningDaq::begin(double t, const Plant&) noexcept {
  origin_ = t;
  scans_ = arrived_ = handed_ = 0;
  channel_ = 0;
  samples_ = SampleClock(period_);
  report_.store({});
  arrival_ = t;
  arrival_ = arrival_of_next_block();
}

double ScanningDaq::due() const noexcept {
  if (!running_) return std::numeric_limits<double>::infinity();
  return origin_ + static_cast<double>(scans_) * true_period_;
}

void ScanningDaq::look(const Plant& plant) noexcept {
  converters_.read(*world_, plant, due(), scans_, stored(scans_));
  ++scans_;
}

/// Blocks do not overtake each other.
double ScanningDaq::arrival_of_next_block() noexcept {
  const double taken = origin_ + static_cast<double>(arrived_ + block_ - 1) * true_period_;
  return std::max(arrival_, taken - jitter_ * std::log(1 - random_.uniform()));
}

std::span<Reading> ScanningDaq::stored(std::uint64_t scan) noexcept {
  return std::span(buffer_).subspan(scan % capacity_ * converters_.size(), converters_.size());
}

Readings ScanningDaq::read(std::span<Reading> out) noexcept {
  Readings readings;
  world_->look([&](double t, const Plant&, double) {
    while (arrived_ + block_ <= scans_ && arrival_ <= t) {
      arrived_ += block_;
      samples_.arrived(arrived_ - 1, arrival_);
      arrival_ = arrival_of_next_block();
    }
    report_.store(samples_.estimate());
    if (scans_ > handed_ + capacity_) {
      handed_ = scans_ - capacity_;
      channel_ = 0;
    }
    while (handed_ < arrived_ && readings.count < out.size()) {
      if (channel_ == 0) time_ = samples_.time_of(handed_);
      Reading& reading = out[readings.count++] = stored(handed_)[channel_];
      reading.time = time_;
      if (++channel_ < converters_.size()) continue;
      channel_ = 0;
      ++handed_;
    }
  });
  return readings;
}

}  // namespace emtb::simulated
