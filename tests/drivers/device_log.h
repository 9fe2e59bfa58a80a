#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <set>
#include <vector>

#include "hal/input_device.h"
#include "tests/process.h"

namespace emtb {

/// Everything that a device gave, asked for as the loop would have.
class DeviceLog {
 public:
  explicit DeviceLog(InputDevice& device) : device_(device) {}

  void look() {
    std::array<Reading, 16> out{};
    const Readings got = device_.read(out);
    for (std::size_t k = 0; k < got.count; ++k) readings.push_back(out[k]);
    if (got.fault != Fault::none) faults.insert(got.fault);
    fault = got.fault;
  }
  void look_for(double seconds) {
    eventually(
        [&] {
          look();
          return false;
        },
        seconds);
  }
  bool comes(const std::function<bool()>& is_so, double seconds = 20) {
    return eventually(
        [&] {
          look();
          return is_so();
        },
        seconds);
  }
  bool comes_reading(double value) {
    return comes(
        [&] { return !readings.empty() && std::abs(readings.back().value - value) < 1e-9 && fault == Fault::none; });
  }
  bool comes_fault(Fault which) {
    return comes([&] { return fault == which; });
  }
  void begin() {
    device_.start();
    readings.clear();
    faults.clear();
  }

  std::vector<Reading> of(Signal signal) const {
    std::vector<Reading> own;
    for (const Reading& reading : readings) {
      if (reading.signal == signal) own.push_back(reading);
    }
    return own;
  }
  /// The last reading of a signal; NaN: there was none.
  double last(Signal signal) const {
    const std::vector<Reading> own = of(signal);
    return own.empty() ? std::nan("") : own.back().value;
  }
  /// None is missing from the first on, and time grows. @return [s] of the last
  double expect_all_in_order(Signal signal) const {
    double time = -1;
    std::uint64_t next = 0;
    for (const Reading& reading : of(signal)) {
      EXPECT_GT(reading.time, time);
      EXPECT_EQ(reading.sequence, next++);
      time = reading.time;
    }
    return time;
  }
  /// The longest pause between two readings of a signal: how long, and how many numbers on.
  struct Gap {
    double seconds = 0;
    std::uint64_t numbers = 0;
  };
  Gap longest_gap(Signal signal) const {
    Gap longest;
    const std::vector<Reading> own = of(signal);
    for (std::size_t k = 1; k < own.size(); ++k) {
      const double seconds = own[k].time - own[k - 1].time;
      if (seconds > longest.seconds) longest = {seconds, own[k].sequence - own[k - 1].sequence};
    }
    return longest;
  }

  std::vector<Reading> readings;
  std::set<Fault> faults;
  Fault fault = Fault::none;

 private:
  InputDevice& device_;
};

}  // namespace emtb
