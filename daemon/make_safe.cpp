#include "daemon/make_safe.h"

#include <cstdio>
#include <exception>
#include <optional>
#include <string>

#include "drivers/registry.h"
#include "hal/error.h"

namespace emtb {

int make_safe(const BenchConfig& config, const char* program) noexcept {
  try {
    const Bench opened = open_reference(config);
    if (const Fault fault = opened.reference->make_safe(); fault != Fault::none) {
      throw DeviceError(config.reference.device + ": " + std::string(text(fault)));
    }
    return 0;
  } catch (const std::exception& e) {
    if (program != nullptr) std::fprintf(stderr, "%s: THE REFERENCE MAY NOT BE SAFE: %s\n", program, e.what());
  }
  return 1;
}

int make_safe(const std::filesystem::path& bench, const char* program) noexcept {
  std::optional<BenchConfig> config;
  try {
    config = read_bench(bench);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s: %s\n", program, e.what());
    return 2;
  }
  return make_safe(*config, program);
}

}  // namespace emtb
