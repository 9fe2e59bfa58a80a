#include "daemon/loop.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <exception>

#include "hal/error.h"
#include "session/session.h"

namespace emtb {
namespace {

constexpr double shortest_patience =
    0.25;                             // [s] a stall of the machine alone takes 50 ms; a runaway needs about a second
constexpr double missed_periods = 5;  // readings that a slow meter may skip before it is stale
constexpr double safe_repeat = 0.1;   // [s] between repeats of make_safe() while latched
constexpr double late_memory = 1;     // [s] over which missed deadlines are forgotten
constexpr double rounding = 1e-6;     // [s] of the clock: a run of 1 s at 1 kHz has 1000 ticks, not 1001
constexpr std::size_t buffer_size = 1024;  // readings a call; some blocks of eight channels
constexpr int reads_per_tick = 8;          // so that one device cannot keep the loop
constexpr double clock_error = 0.1;        // [s] that a device's time stamps may be off

bool is_fault(std::uint16_t code) noexcept { return code >= 100; }

}  // namespace

Loop::Loop(Bench& bench, const Settings& settings, Mailbox& mailbox, Live& live, Ring& ring, EstimatorFeed* feed,
           Trace* trace)
    : bench_(bench),
      settings_(settings),
      mailbox_(mailbox),
      live_(live),
      ring_(ring),
      feed_(feed),
      trace_(trace),
      safety_(settings.limits, settings.reference, settings.rate),
      buffer_(buffer_size),
      u_(settings.reference.safe) {
  if (settings_.tacho) tacho_.emplace(*settings_.tacho, settings_.R_a);
  std::array<bool, signal_count> taken{};
  double slowest = 0;
  for (const auto& device : bench_.inputs) {
    const auto channels = device->channels();
    ports_.push_back({.device = device.get(),
                      .signal = channels.empty() ? std::nullopt : std::optional{channels.front().signal},
                      .first = watched_.size(),
                      .count = channels.size()});
    for (const Channel& channel : channels) {
      if (taken[index(channel.signal)]) {
        throw ConfigError("two channels measure " + std::string(info(channel.signal).name) + ". Keep one");
      }
      taken[index(channel.signal)] = true;
      const double period = std::max(channel.period, settings_.period);
      watched_.push_back({.signal = channel.signal,
                          .patience = std::max(shortest_patience, missed_periods * period + channel.window),
                          .window = channel.window});
      slowest = std::max(slowest, std::max(period, channel.window));
    }
  }
  if (settings_.field_min) need(Signal::i_f, "field.min");
  if (tacho_) {
    for (const Signal signal : {Signal::omega, Signal::e_a, Signal::i_a}) need(signal, "tacho");
  }
  linger_ = std::min(2.0, 0.05 + 1.5 * slowest);  // a slow meter's last reading, but no run hangs on for a dead one
}

void Loop::need(Signal signal, const char* key) const {
  if (std::ranges::find(watched_, signal, &Watched::signal) != watched_.end()) return;
  throw ConfigError(std::string(key) + " needs " + std::string(info(signal).name) +
                    ", which no device of this bench measures. Add a channel for it, or remove the check");
}

void Loop::start() noexcept {
  now_ = bench_.clock->now();
  if (const Fault fault = make_safe(); fault != Fault::none) trip({fault, {}, 0});
  start_devices();
  publish();
}

bool Loop::start_devices() noexcept {
  bool all = true;
  for (const Port& port : ports_) {
    try {
      port.device->start();
    } catch (const std::exception&) {  // whatever a driver throws: the bench cannot be trusted without it
      trip({Fault::device_lost, port.signal, 0});
      all = false;
    }
  }
  now_ = bench_.clock->now();
  if (tacho_) tacho_->restart();
  for (Watched& watched : watched_) {
    watched.last = now_;
    watched.next = 0;
    watched.seen = false;
  }
  return all;
}

bool Loop::wanted() const noexcept {
  return mailbox_.run.load(std::memory_order_relaxed) != nullptr ||
         mailbox_.resets.load(std::memory_order_relaxed) != resets_;
}

void Loop::prepare() noexcept {
  if (const auto asked = mailbox_.resets.load(); asked != resets_) {
    resets_ = asked;
    reset_stops_ = mailbox_.reset_stops.load();
    if (state_ == LoopState::latched && reset_stops_ == mailbox_.stops.load()) {
      safety_.clear();
      late_ = 0;
      enter(LoopState::arming);
      if (const Fault fault = make_safe(); fault != Fault::none) trip({fault, {}, 0});
      start_devices();
    }
  }
  if (order_ == nullptr) {
    if (const Order* order = mailbox_.run.exchange(nullptr); order != nullptr) begin(*order);
  }
  publish();
}

void Loop::begin(const Order& order) noexcept {
  order_ = &order;
  ended_ = false;
  t0_ = now_;  // until the first tick sets it
  live_.run_time.store(0);
  live_.profile_time.store(0);
  if (state_ != LoopState::armed) {  // it latched between the question and the order
    const Fault cause = safety_.cause() ? safety_.cause().fault : Fault::terminated;
    if (is_fault(static_cast<std::uint16_t>(cause))) {
      push_surely({.kind = Record::Kind::event, .code = static_cast<std::uint16_t>(cause), .at = now_});
    }
    end(Outcome::fault, cause);
    return;
  }
  if (order.stops != mailbox_.stops.load()) return end(Outcome::stopped, Fault::none);
  enter(LoopState::running);
  pause_ = 0;
  waiting_ = false;
  paused_ = 0;
  t0_ = std::nan("");
  late_ = 0;
  start_devices();
}

void Loop::tick(double now, std::uint64_t missed) noexcept {
  dt_ = now - now_;
  now_ = now;
  flush_pending();
  if (state_ == LoopState::running && std::isnan(t0_)) {
    t0_ = now;
    if (field_since_) push({.kind = Record::Kind::field, .value = now - *field_since_, .at = now});
  }
  check(now, missed);
  read(now);
  arm_if_all_is_well();
  drive(now);
  publish();
}

void Loop::check(double now, std::uint64_t missed) noexcept {
  live_.missed.store(live_.missed.load(std::memory_order_relaxed) + missed, std::memory_order_relaxed);
  if (mailbox_.terminate.load(std::memory_order_relaxed)) trip({Fault::terminated, {}, 0});
  if (mailbox_.recorder_failed.load(std::memory_order_relaxed)) trip({Fault::recorder_failed, {}, 0});
  const std::uint64_t guardians_lost = mailbox_.guardians_lost.load(std::memory_order_relaxed);
  if (guardians_lost != guardians_lost_ || mailbox_.unguarded.load(std::memory_order_relaxed)) {
    guardians_lost_ = guardians_lost;
    trip({Fault::guardian_lost, {}, 0});
  }

  late_ = late_ * std::max(0.0, 1 - settings_.period / late_memory) + static_cast<double>(missed) * settings_.period;
  if (missed > 0 && state_ == LoopState::running && settings_.real_time) {
    push({.kind = Record::Kind::event,
          .code = event_code::gap,
          .t = now - t0_,
          .value = static_cast<double>(missed),
          .at = now});
  }
  if (settings_.real_time && late_ > settings_.late_limit) trip({Fault::overrun, {}, static_cast<double>(missed)});

  obey_stop();
  if (state_ != LoopState::running) return;
  if (mailbox_.disk_low.load(std::memory_order_relaxed)) return trip({Fault::disk_nearly_full, {}, 0});
  if (mailbox_.lost.load(std::memory_order_relaxed) == order_->id) return trip({Fault::client_lost, {}, 0});
  trip(safety_.judge_run_time(now - t0_));
}

/// A stop is of all that was asked for before it: a run, an arming.
void Loop::obey_stop() noexcept {
  const std::uint64_t stops = mailbox_.stops.load(std::memory_order_relaxed);
  if (stops == stops_) return;
  stops_ = stops;
  stopped_run_ = 0;
  if (state_ == LoopState::arming && reset_stops_ != stops) {
    enter(LoopState::latched);
    if (const Fault fault = make_safe(); fault != Fault::none) trip({fault, {}, 0});
  }
  if (state_ == LoopState::running && order_->stops != stops) {
    stopped_run_ = order_->id;
    end(Outcome::stopped, Fault::none);
  }
}

void Loop::read(double now) noexcept {
  for (Port& port : ports_) {
    for (int round = 0; round < reads_per_tick; ++round) {
      const Readings got = port.device->read(buffer_);
      const std::size_t count = std::min(got.count, buffer_.size());
      for (std::size_t i = 0; i < count; ++i) take(port, buffer_[i]);
      if (got.fault != Fault::none) trip({got.fault, port.signal, 0});
      if (count < buffer_.size() || got.fault != Fault::none) break;
    }
  }
  for (const Watched& watched : watched_) {
    if (now - watched.last > watched.patience) trip({Fault::stale_signal, watched.signal, now - watched.last});
  }
}

void Loop::take(Port& port, const Reading& reading) noexcept {
  const Trip beyond = safety_.judge(reading);
  trip(beyond);
  if (beyond.fault == Fault::non_finite) return;  // the event tells; a file of numbers holds numbers

  const auto first = watched_.begin() + static_cast<std::ptrdiff_t>(port.first);
  const auto last = first + static_cast<std::ptrdiff_t>(port.count);
  const auto watched = std::find_if(first, last, [&](const Watched& w) { return w.signal == reading.signal; });
  if (watched == last) return;  // a signal that the device never announced
  // The first one since a start is: a replay begins its time anew.
  const bool newer = !watched->seen || reading.time > live_.time[index(reading.signal)].load(std::memory_order_relaxed);
  const std::uint64_t gap = watched->seen && reading.sequence > watched->next ? reading.sequence - watched->next : 0;
  watch(*watched, reading);
  watched->next = reading.sequence + 1;
  watched->stamp = reading.time;
  if (!newer) return;
  watched->last = std::min(reading.time, now_);  // a time ahead of ours must not hide a device that falls silent
  watched->seen = true;
  live_.value[index(reading.signal)].store(reading.value, std::memory_order_relaxed);
  live_.time[index(reading.signal)].store(reading.time, std::memory_order_relaxed);

  if (reading.signal == Signal::u_ref) return;  // the command itself is recorded: exact, and of the same instant
  const double t = reading.time - t0_;
  const bool in_run = order_ != nullptr && t >= 0 && !(ended_ && t > end_.t);  // NaN before the first tick: no
  if (!in_run) return glimpse(reading.signal, reading.time, reading.value);
  if (gap > 0) {
    push({.kind = Record::Kind::event,
          .code = event_code::gap,
          .signal = reading.signal,
          .t = t,
          .value = static_cast<double>(gap),
          .at = reading.time});
  }
  push({.signal = reading.signal, .t = t, .value = reading.value, .at = reading.time});
}

void Loop::watch(const Watched& watched, const Reading& reading) noexcept {
  const bool of_field = reading.signal == Signal::i_f && settings_.field_min;
  const bool no_field = of_field && std::abs(reading.value) < *settings_.field_min;
  if (no_field) field_since_.reset();
  if (of_field && !no_field && !field_since_) field_since_ = reading.time;
  if (state_ == LoopState::latched) return;
  const bool ahead = reading.time > now_ + clock_error && reading.time > bench_.clock->now() + clock_error;
  const bool back = watched.seen && reading.time < watched.stamp - clock_error;
  if (ahead || back) trip({Fault::device_clock, reading.signal, reading.time - (ahead ? now_ : watched.stamp)});
  if (no_field) trip({Fault::field_lost, Signal::i_f, reading.value});
  if (tacho_) trip(tacho_->take(reading, watched.window));
}

void Loop::arm_if_all_is_well() noexcept {
  if (state_ != LoopState::arming) return;
  if (!std::ranges::all_of(watched_, &Watched::seen)) return;  // stale_signal ends the wait
  safety_.arm();
  if (!settings_.field_min) field_since_ = now_;  // whoever armed has seen to it
  enter(LoopState::armed);
}

void Loop::drive(double now) noexcept {
  Fault fault = Fault::none;
  switch (state_) {
    case LoopState::latched:
    case LoopState::arming:
      glimpse(Signal::u_ref, now, u_);
      if (now < safe_again_ && now > safe_again_ - 2 * safe_repeat) break;
      safe_again_ = now + safe_repeat;
      fault = make_safe();
      break;
    case LoopState::armed:
      u_ = safety_.safe();
      fault = bench_.reference->set(u_);
      glimpse(Signal::u_ref, now, u_);
      break;
    case LoopState::running: {
      const double t = now - t0_;
      const double at = profile_time(t);
      live_.profile_time.store(at, std::memory_order_relaxed);
      if (state_ != LoopState::running) break;  // nobody came
      if (at >= order_->profile.duration() - rounding && !waiting_) {
        end(Outcome::done, Fault::none);
        break;
      }
      const double u = safety_.shape(order_->profile.reference(at), u_, dt_);
      fault = bench_.reference->set(u);
      if (fault != Fault::none) break;
      u_ = u;
      push({.signal = Signal::u_ref, .t = t, .value = u, .at = now});
      break;
    }
  }
  if (fault != Fault::none) trip({fault, {}, u_});

  if (ended_ && order_ != nullptr && now >= t0_ + end_.t + linger_) {
    push_surely(end_);
    order_ = nullptr;
  }
}

/// The profile's time [s] stands still while a person has something to do.
double Loop::profile_time(double t) noexcept {
  while (pause_ < order_->pauses.size() && t - paused_ >= order_->pauses[pause_].at - rounding) {
    const Pause& pause = order_->pauses[pause_];
    if (!waiting_) {
      waiting_ = true;
      waits_since_ = t;
      tell(event_code::paused, t);
      live_.pause.store(static_cast<int>(pause_), std::memory_order_relaxed);
    }
    const bool confirmed = mailbox_.confirmed.load(std::memory_order_relaxed) == confirmation(order_->id, pause_);
    const bool alone = t - waits_since_ > pause.within;
    if (!confirmed && !alone) return pause.at - 2 * rounding;  // what stood before a jump at this very time
    waiting_ = false;
    live_.pause.store(-1, std::memory_order_relaxed);
    tell(confirmed ? event_code::resumed : event_code::unattended, t);
    if (!confirmed) {
      end(Outcome::stopped, Fault::none);
      return t - paused_;
    }
    paused_ = t - pause.at;
    ++pause_;
  }
  return t - paused_;
}

void Loop::tell(int code, double t) noexcept {
  push({.kind = Record::Kind::event,
        .code = static_cast<std::uint16_t>(code),
        .t = t,
        .value = static_cast<double>(pause_ + 1),
        .at = now_});
}

void Loop::trip(const Trip& trip) noexcept {
  if (!trip) return;
  const bool first = safety_.trip(trip);
  const bool running = state_ == LoopState::running;
  const bool moved = state_ != LoopState::latched;
  enter(LoopState::latched);
  if (moved) {  // at once, not at the end of the tick
    safe_again_ = make_safe() == Fault::none ? now_ + safe_repeat : now_;
  }
  if (first || running) {
    push_surely({.kind = Record::Kind::event,
                 .code = static_cast<std::uint16_t>(trip.fault),
                 .signal = trip.signal,
                 .t = order_ != nullptr && !std::isnan(t0_) ? now_ - t0_ : 0,
                 .value = trip.value,
                 .at = now_});
  }
  if (running) end(Outcome::fault, trip.fault);
}

Fault Loop::make_safe() noexcept {
  u_ = safety_.safe();
  const Fault fault = bench_.reference->make_safe();
  if (fault != Fault::none && !output_broken_) {  // told even where another cause came first: nothing is worse
    push_surely({.kind = Record::Kind::event,
                 .code = static_cast<std::uint16_t>(fault),
                 .signal = Signal::u_ref,
                 .t = order_ != nullptr && !std::isnan(t0_) ? now_ - t0_ : 0,
                 .value = u_,
                 .at = now_});
  }
  output_broken_ = fault != Fault::none;
  return fault;
}

void Loop::end(Outcome outcome, Fault fault) noexcept {
  if (std::isnan(t0_)) t0_ = now_;  // it ended before its first tick
  const double t = now_ - t0_;
  if (state_ == LoopState::running) enter(LoopState::armed);
  Fault broken = Fault::none;
  if (outcome != Outcome::fault) broken = make_safe();  // after a fault, trip() did it
  ended_ = true;
  live_.pause.store(-1, std::memory_order_relaxed);
  end_ = {.kind = Record::Kind::end, .outcome = outcome, .code = static_cast<std::uint16_t>(fault), .t = t, .at = now_};
  push({.signal = Signal::u_ref, .t = t, .value = u_, .at = now_});
  live_.run_time.store(t, std::memory_order_relaxed);
  if (broken != Fault::none) {
    end_.outcome = Outcome::fault;
    end_.code = static_cast<std::uint16_t>(broken);
    trip({broken, {}, u_});
  }
}

void Loop::enter(LoopState state) noexcept {
  if (state == state_) return;
  state_ = state;
  ring_.push({.kind = Record::Kind::state, .value = static_cast<double>(state), .at = now_});
}

/// Where the ring is full, the black box has a gap; a run has a fault.
void Loop::glimpse(Signal signal, double at, double value) noexcept {
  if (trace_ != nullptr) trace_->take(signal, at, value);
  ring_.push({.kind = Record::Kind::glimpse, .signal = signal, .value = value, .at = at});
}

void Loop::push(const Record& record) noexcept {
  if (trace_ != nullptr && record.kind == Record::Kind::sample && record.signal) {
    trace_->take(*record.signal, record.at, record.value);
  }
  if (feed_ != nullptr) feed_->take(record);
  if (ring_.push(record)) return;
  if (!settings_.real_time) {  // simulated time can wait, and the recorder empties the ring even when it has failed
    constexpr timespec moment{0, 1'000'000};
    while (!ring_.push(record)) clock_nanosleep(CLOCK_MONOTONIC, 0, &moment, nullptr);
    return;
  }
  if (state_ == LoopState::running) trip({Fault::recorder_behind, record.signal, 0});
}

void Loop::push_surely(const Record& record) noexcept {
  if (feed_ != nullptr) feed_->take(record);
  flush_pending();
  if (pending_count_ == 0 && ring_.push(record)) return;
  if (pending_count_ < pending_.size()) {
    pending_[pending_count_++] = record;
  } else if (record.kind == Record::Kind::end) {
    pending_.back() = record;  // without its end a session would never close
  }
}

void Loop::flush_pending() noexcept {
  std::size_t sent = 0;
  while (sent < pending_count_ && ring_.push(pending_[sent])) ++sent;
  std::move(pending_.begin() + static_cast<std::ptrdiff_t>(sent),
            pending_.begin() + static_cast<std::ptrdiff_t>(pending_count_), pending_.begin());
  pending_count_ -= sent;
}

void Loop::publish() noexcept {
  constexpr auto relaxed = std::memory_order_relaxed;
  const Trip& cause = safety_.cause();
  live_.fault_signal.store(cause.signal ? static_cast<int>(index(*cause.signal)) : -1, relaxed);
  live_.fault_value.store(cause.value, relaxed);
  live_.fault.store(cause.fault, relaxed);
  live_.output_broken.store(output_broken_, relaxed);
  live_.u_ref.store(u_, relaxed);
  live_.now.store(now_, relaxed);
  if (state_ == LoopState::running && !std::isnan(t0_)) live_.run_time.store(now_ - t0_, relaxed);
  live_.ticks.store(live_.ticks.load(relaxed) + 1, relaxed);
  live_.state.store(state_, std::memory_order_release);
  if (state_ != LoopState::arming) live_.resets.store(resets_, std::memory_order_release);
  live_.stopped_run.store(stopped_run_, relaxed);
  live_.stops.store(stops_, std::memory_order_release);
}

}  // namespace emtb
