#include "drivers/simulated/meter.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "hal/error.h"

namespace emtb::simulated {

Meter::Meter(std::string name, std::shared_ptr<World> world, const MeterSettings& settings)
    : name_(std::move(name)), world_(std::move(world)), settings_(settings) {
  if (!(settings_.window > 0 && settings_.window <= settings_.period)) {
    throw ConfigError(name_ + ": window must be above 0 and at most the period");
  }
  description_ = {.signal = Signal::i_a,
                  .period = settings_.period,
                  .window = settings_.window,
                  .lsb = settings_.resolution,
                  .source = name_ + " i_a (simulated)",
                  .endless = true};
  world_->attach(this);
}

Meter::~Meter() { world_->detach(this); }

void Meter::start() {
  ++recordings_;
  noise_ = Noise(settings_.noise, 0, stream(world_->seed(), recordings_, description_.source));
  written_ = read_ = 0;
  running_ = true;
  world_->restart();
}

void Meter::begin(double t, const Plant& plant) noexcept {
  origin_ = t;
  window_ = 0;
  written_ = read_ = 0;
  charge_ = plant.charge();
  squares_ = plant.squares();
  open_ = settings_.window == settings_.period;
}

double Meter::due() const noexcept {
  if (!running_) return std::numeric_limits<double>::infinity();
  const double end = origin_ + static_cast<double>(window_ + 1) * settings_.period;
  return open_ ? end : end - settings_.window;
}

void Meter::look(const Plant& plant) noexcept {
  if (open_) {
    const double mean = (plant.charge() - charge_) / settings_.window;
    const double square = (plant.squares() - squares_) / settings_.window;
    double value = (settings_.rms ? std::sqrt(square) : mean) + settings_.offset + noise_.next();
    if (settings_.resolution > 0) value = std::round(value / settings_.resolution) * settings_.resolution;
    buffer_[written_ % buffer_.size()] = {.signal = Signal::i_a, .time = due(), .value = value, .sequence = window_};
    ++written_;
    ++window_;
    open_ = settings_.window == settings_.period;  // then the next one begins right here
  } else {
    open_ = true;
  }
  charge_ = plant.charge();
  squares_ = plant.squares();
}

Readings Meter::read(std::span<Reading> out) noexcept {
  std::size_t count = 0;
  world_->look([&](double t, const Plant&, double) {
    if (written_ > buffer_.size()) read_ = std::max(read_, written_ - buffer_.size());
    while (count < out.size() && read_ < written_) {
      const Reading& reading = buffer_[read_ % buffer_.size()];
      if (reading.time + settings_.latency > t + 1e-6) break;
      out[count++] = reading;
      ++read_;
    }
  });
  return {.count = count, .fault = Fault::none};
}

}  // namespace emtb::simulated
