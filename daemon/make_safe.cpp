#include "daemon/make_safe.h"

#include <cstdio>
#include <exception>
#include <optional>
#include <string>

#include "drivers/registry.h"
#include "hal/error.h"

namespace emtb {

int make_safe(const std::filesystem::path& bench, const char* program) noexcept {
  int bad = 2;
  try {
    const BenchConfig config = read_bench(bench);
    bad = 1;
    const Bench opened = open_reference(config);
    if (const Fault fault = opened.reference->make_safe(); fault != Fault::none) {
      throw DeviceError(config.reference.device + ": " + std::string(text(fault)));
    }
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s: %s%s\n", program, bad == 1 ? "THE REFERENCE MAY NOT BE SAFE: " : "", e.what());
  }
  return bad;
}

}  // namespace emtb
