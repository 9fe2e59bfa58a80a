#pragma once

#include <array>
#include <cmath>
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

  std::vector<Reading> readings;
  std::set<Fault> faults;
  Fault fault = Fault::none;

 private:
  InputDevice& device_;
};

}  // namespace emtb
