#pragma once

#include <string>

#include "config/bench.h"
#include "drivers/registry.h"
#include "hal/error.h"
#include "tests/temporary_file.h"

namespace emtb {

/// A bench with one device for everything, as from its file.
/// @param reference its keys beside `device` @param device its keys beside `channels`; it stands on line 5
inline Bench opened_bench(const std::string& reference, const std::string& device, const std::string& channels) {
  const TemporaryFile file(".yaml", "name: b\nrate: 200\nreference: {device: daq, " + reference +
                                        "}\ndevices:\n  daq: {" + device + ", channels: {" + channels + "}}\n");
  return open_bench(read_bench(file.path()));
}

/// Why it is refused; `none`: it is not.
template <class Open>
std::string refusal_of(Open open) {
  try {
    open();
  } catch (const Error& e) {
    return e.what();
  }
  return "none";
}

}  // namespace emtb
