#pragma once

#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "hal/bench.h"
#include "hal/error.h"

namespace emtb {

/// Time that moves only when a test says so, or when somebody sleeps.
class FakeClock final : public Clock {
 public:
  double now() const noexcept override { return now_; }
  void sleep_until(double t) noexcept override {
    if (t > now_) now_ = t;
  }

 private:
  std::atomic<double> now_{1000};  // [s] some origin that is not zero
};

/// What a fake device does wrong.
enum class Failure {
  none,
  error,     ///< the call returns a fault
  time_out,  ///< the driver reports that the device did not answer in time
  nan,       ///< a reading that is no number
  infinite,  ///< a reading without end
  stall,     ///< nothing comes any more, and no fault is reported
  gone,      ///< the device disappeared: every call fails, start() throws
  refused,   ///< start() throws; what runs goes on
  ahead,     ///< time stamps of a clock that is a second ahead
  behind,    ///< and a second behind
};

/// An input device that reads `value` on each of its signals at each call, and fails on request.
class FaultyInput final : public InputDevice {
 public:
  FaultyInput(std::shared_ptr<const Clock> clock, std::vector<Channel> channels)
      : clock_(std::move(clock)), channels_(std::move(channels)), values_(channels_.size()) {}

  std::span<const Channel> channels() const noexcept override { return channels_; }

  void start() override {
    ++starts;
    if (failure == Failure::gone || failure == Failure::refused) throw DeviceError("fake: gone");
    sequence_ = 0;
  }

  Readings read(std::span<Reading> out) noexcept override {
    if (failure == Failure::gone) return {0, Fault::device_lost};
    if (failure == Failure::error) return {0, Fault::device_lost};
    if (failure == Failure::time_out) return {0, Fault::stale_signal};
    if (failure == Failure::stall) return {};
    const double error = failure == Failure::ahead ? 1 : failure == Failure::behind ? -1 : 0;  // [s]
    sequence_ += skip.exchange(0);
    std::size_t count = 0;
    for (; count < channels_.size() && count < out.size(); ++count) {
      double value = values_[count];
      if (failure == Failure::nan) value = std::nan("");
      if (failure == Failure::infinite) value = std::numeric_limits<double>::infinity();
      out[count] = {channels_[count].signal, clock_->now() - latency + error, value, sequence_};
    }
    ++sequence_;
    return {count, Fault::none};
  }

  void set(Signal signal, double value) {
    for (std::size_t i = 0; i < channels_.size(); ++i) {
      if (channels_[i].signal == signal) values_[i] = value;
    }
  }

  std::atomic<Failure> failure{Failure::none};
  std::atomic<std::uint64_t> skip{0};  ///< readings that the next call has lost
  std::atomic<int> starts{0};
  double latency = 0;  ///< [s] age of a reading when it is handed over

 private:
  std::shared_ptr<const Clock> clock_;
  std::vector<Channel> channels_;
  std::vector<std::atomic<double>> values_;
  std::uint64_t sequence_ = 0;
};

/// A reference output that remembers what it was told, and fails on request.
class FaultyOutput final : public AnalogOutput {
 public:
  explicit FaultyOutput(Limits limits) : limits_(limits), volts(limits.safe) {}

  Fault set(double wanted) noexcept override {
    ++sets;
    if (fail_set != Fault::none) return fail_set;
    volts = wanted;
    if (wanted > highest) highest = wanted;
    if (wanted < lowest) lowest = wanted;
    return Fault::none;
  }
  Fault make_safe() noexcept override {
    ++safes;
    if (fail_safe != Fault::none) return fail_safe;
    volts = limits_.safe;
    return Fault::none;
  }
  Limits limits() const noexcept override { return limits_; }

 private:
  Limits limits_;

 public:
  std::atomic<double> volts;  ///< [V] now; unclamped, so that a test sees what the loop asks for
  std::atomic<double> highest{-1e9}, lowest{1e9};
  std::atomic<Fault> fail_set{Fault::none}, fail_safe{Fault::none};
  std::atomic<int> sets{0}, safes{0};
};

/// A bench of fakes: a card for omega and e_a read at every tick, a meter for i_a on the same beat.
struct FaultyBench {
  explicit FaultyBench(Limits limits = {.min = 0, .max = 6, .safe = 0}) : clock(std::make_shared<FakeClock>()) {
    auto the_card = std::make_unique<FaultyInput>(
        clock,
        std::vector<Channel>{{.signal = Signal::omega, .period = 1e-3, .window = 0, .lsb = 0.1, .source = "card 0"},
                             {.signal = Signal::e_a, .period = 1e-3, .window = 0, .lsb = 0.1, .source = "card 1"}});
    auto the_meter = std::make_unique<FaultyInput>(
        clock,
        std::vector<Channel>{{.signal = Signal::i_a, .period = 1e-3, .window = 0, .lsb = 1e-3, .source = "meter"}});
    auto the_output = std::make_unique<FaultyOutput>(limits);
    card = the_card.get();
    meter = the_meter.get();
    output = the_output.get();
    bench.clock = clock;
    bench.inputs.push_back(std::move(the_card));
    bench.inputs.push_back(std::move(the_meter));
    bench.reference = std::move(the_output);
  }

  std::shared_ptr<FakeClock> clock;
  Bench bench;
  FaultyInput* card = nullptr;
  FaultyInput* meter = nullptr;
  FaultyOutput* output = nullptr;
};

}  // namespace emtb
