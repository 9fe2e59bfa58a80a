// One of the targets, EMTB_FUZZ_TARGET, for libFuzzer.
#include <cstddef>
#include <cstdint>

#include "tests/fuzz/targets.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  emtb::fuzz::EMTB_FUZZ_TARGET({reinterpret_cast<const char*>(data), size});
  return 0;
}
