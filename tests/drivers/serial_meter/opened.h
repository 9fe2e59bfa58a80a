#pragma once

#include <memory>
#include <string>

#include "config/bench.h"
#include "drivers/registry.h"
#include "drivers/serial_meter/open.h"
#include "tests/temporary_file.h"

namespace emtb::serial_meter {

/// A bench of one meter. @param device its line in the bench file
inline BenchConfig bench_of(const std::string& device) {
  const TemporaryFile file(
      ".yaml", "name: b\nreference: {device: meter, min: 0, max: 6, safe: 0}\ndevices:\n  meter: {" + device + "}\n");
  return read_bench(file.path());
}

inline std::unique_ptr<InputDevice> opened(const std::string& device) {
  const BenchConfig bench = bench_of(device);
  return open_meter({.bench = bench,
                     .device = bench.devices[0],
                     .clock = std::make_shared<MonotonicClock>(),
                     .world = nullptr})
      .input;
}

}  // namespace emtb::serial_meter
