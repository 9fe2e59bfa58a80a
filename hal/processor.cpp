#include "hal/processor.h"

#include <cstdlib>
#include <string>
#include <string_view>

#include "hal/error.h"

namespace emtb {

bool has(Processor processor) noexcept {
#if defined(__x86_64__)
  return processor == Processor::any || (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"));
#else
  return processor == Processor::any;
#endif
}

Processor processor() {
  const char* wish = std::getenv("EMTB_SIMD");
  const std::string_view named = wish == nullptr ? "" : wish;
  if (named == "baseline") return Processor::any;
  if (named.empty()) return has(Processor::avx2) ? Processor::avx2 : Processor::any;
  if (named != "avx2") {
    throw ModelError("EMTB_SIMD is `" + std::string(named) + "`. Write `baseline` or `avx2`, or leave it out.");
  }
  if (!has(Processor::avx2)) {
    throw ModelError("EMTB_SIMD is `avx2`, which this machine has not. Write `baseline`, or leave it out.");
  }
  return Processor::avx2;
}

}  // namespace emtb
