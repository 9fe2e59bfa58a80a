#pragma once

namespace emtb {

/// The processors that the innermost loops are compiled for. The program as a whole runs on any of its architecture;
/// what is compiled for one of them is called where the machine has it (docs/decisions/simd.md).
enum class Processor {
  any,  ///< of the architecture: SSE2 on x86-64, NEON on arm64
  avx2  ///< x86-64 with AVX2 and FMA: Intel since 2013, AMD since 2015
};

/// Has this machine such a processor?
bool has(Processor processor) noexcept;

/// The best that this machine has; or what the environment variable EMTB_SIMD names: `baseline` or `avx2`.
/// @throws ModelError where EMTB_SIMD names something else, or what this machine has not
Processor processor();

}  // namespace emtb
