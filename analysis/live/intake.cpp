#include "analysis/live/intake.h"

#include <algorithm>
#include <cmath>

namespace emtb {
namespace {

constexpr std::size_t most_waiting = 1024;  ///< readings: some ticks of all channels at 10 kHz; by hand
constexpr double longest_ahead = 1;         ///< [s] that a reading may be ahead of the reference; by hand

double lsb_of(std::span<const Channel> channels, Signal signal) {
  const Channel* channel = find_channel(channels, signal);
  return channel == nullptr ? 0 : channel->lsb;
}

}  // namespace

LiveIntake::LiveIntake(const LivePlan& plan, std::span<const Channel> channels, bool has_driver, LiveHistory& history)
    : plan_(plan),
      channels_(channels.begin(), channels.end()),
      history_(history),
      voltage_(plan.structure, has_driver),
      load_(lsb_of(channels, Signal::torque), plan.settling, plan.period) {
  waiting_.reserve(most_waiting);
}

void LiveIntake::start_run(double field_on) {
  new_run_ = true;
  field_on_ = field_on;
  waiting_.clear();
}

bool LiveIntake::take(Signal signal, double t, double value) {
  if (!std::isfinite(t) || !std::isfinite(value)) {
    ++counts_.skipped;
    return false;
  }
  if (signal == Signal::u_ref) return close_tick(t, value);
  const auto output = std::ranges::find(plan_.outputs, signal, &LivePlan::Output::signal);
  if (output != plan_.outputs.end() && output->slow) {
    take_slow(static_cast<std::size_t>(output - plan_.outputs.begin()), t, value);
    return false;
  }
  if (LiveTick::member_of(signal) == nullptr) return false;
  if (waiting_.size() == waiting_.capacity()) {
    ++counts_.skipped;
    return false;
  }
  waiting_.push_back({signal, t, value});
  return false;
}

void LiveIntake::take_slow(std::size_t output, double t, double value) {
  const Channel& channel = *find_channel(channels_, plan_.outputs[output].signal);
  meters_[index(channel.signal)].add(value);
  double& before = last_slow_[index(channel.signal)];
  const double begin = channel.window > 0 ? t - channel.window : before;
  before = t;
  if (std::isnan(begin) || t <= begin || t - begin > plan_.longest_window) return;
  history_.put_slow(output, begin, t, value);
}

bool LiveIntake::close_tick(double t, double u_ref) {
  LiveTick tick;
  tick.t = t;
  tick.u_ref = u_ref;
  if (new_run_) {
    tick.kind = LiveTick::Kind::run_start;
    tick.field_on = field_on_;
    last_slow_.fill(LiveTick::none);
    new_run_ = false;
    load_.start_run(t);
  } else if (t <= last_t_) {
    ++counts_.skipped;
    return false;
  } else if (t - last_t_ > plan_.longest_gap) {
    tick.kind = LiveTick::Kind::gap;
    ++counts_.gaps;
  }
  const double interval = t - last_t_;
  last_t_ = t;
  ++counts_.samples;
  history_.add(tick);
  attach_waiting(t);
  complete(history_.current().ticks.back(), interval);
  return true;
}

/// Readings go to the ticks of their times; those that are ahead wait on.
void LiveIntake::attach_waiting(double newest) {
  std::size_t kept = 0;
  for (const Reading& reading : waiting_) {
    if (reading.t > newest + 0.5 * plan_.period) {
      if (reading.t < newest + longest_ahead) waiting_[kept++] = reading;
      continue;
    }
    if (!history_.put(reading.signal, reading.t, reading.value, gap_ticks * plan_.period)) ++counts_.skipped;
  }
  waiting_.resize(kept);
}

/// What drives the motor and what loads it. @param interval [s] since the tick before it
void LiveIntake::complete(LiveTick& tick, double interval) {
  if (tick.kind == LiveTick::Kind::next) {
    tick.drive = voltage_.next(interval, tick.u_ref, tick.e_a);
  } else {
    voltage_.start(tick.u_ref, tick.e_a);
    tick.drive = tick.e_a;
  }
  if (plan_.structure.measured_load) {
    if (tick.u_ref != last_u_ref_) load_.expect_change(tick.t);
    tick.load = load_.next(tick.t, tick.torque);
  }
  last_u_ref_ = tick.u_ref;
}

}  // namespace emtb
