#include "drivers/replay/player.h"

#include <algorithm>
#include <functional>

namespace emtb::replay {
namespace {

/// [s] between readings, the median: gaps do not count.
double usual_period(const std::vector<double>& t, double otherwise) {
  if (t.size() < 2) return otherwise;
  std::vector<double> steps(t.size() - 1);
  std::transform(t.begin() + 1, t.end(), t.begin(), steps.begin(), std::minus<>());
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

}  // namespace

Player::Player(std::shared_ptr<PlayClock> clock, Signal signal, Series series)
    : clock_(std::move(clock)), series_(std::move(series)), value_(series_.value.front()) {
  description_ = {.signal = signal,
                  .period = usual_period(series_.t, clock_->end()),
                  .window = series_.window,
                  .lsb = series_.lsb,
                  .source = series_.source};
}

void Player::start() {
  clock_->rewind();
  next_ = 0;
  sequence_ = 0;
  value_ = series_.value.front();
}

Readings Player::read(std::span<Reading> out) noexcept {
  const double now = clock_->now();
  std::size_t count = 0;
  if (clock_->playing() && now <= clock_->end()) {
    const double until = clock_->horizon();
    for (; count < out.size() && next_ < series_.t.size() && (series_.t[next_] <= now || series_.t[next_] < until);
         ++next_) {
      value_ = series_.value[next_];
      out[count++] = {
          .signal = description_.signal, .time = series_.t[next_], .value = value_, .sequence = sequence_++};
    }
  } else if (!out.empty()) {
    out[count++] = {.signal = description_.signal, .time = now, .value = value_, .sequence = sequence_++};
  }
  return {.count = count, .fault = Fault::none};
}

}  // namespace emtb::replay
