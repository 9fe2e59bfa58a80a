#pragma once

#include <cmath>
#include <cstdint>
#include <string_view>

#include "experiment/splitmix64.h"

namespace emtb::simulated {

/// Gaussian noise, white or coloured: each value keeps `correlation` of the one before (AR(1)), at the same sigma.
class Noise {
 public:
  Noise() = default;
  Noise(double sigma, double correlation, std::uint64_t stream) noexcept
      : sigma_(sigma), correlation_(correlation), random_(stream), coloured_(sigma > 0 ? gaussian() : 0) {}

  double next() noexcept {
    if (sigma_ == 0) return 0;
    const double value = coloured_;
    coloured_ = correlation_ * coloured_ + std::sqrt(1 - correlation_ * correlation_) * gaussian();
    return sigma_ * value;
  }

 private:
  /// Box and Muller's transform, one value a call.
  double gaussian() noexcept {
    constexpr double turn = 6.283185307179586;
    return std::sqrt(-2 * std::log(1 - random_.uniform())) * std::cos(turn * random_.uniform());
  }

  double sigma_ = 0;
  double correlation_ = 0;
  SplitMix64 random_{0};
  double coloured_ = 0;
};

/// One stream for each seed, recording and instrument, all unrelated.
inline std::uint64_t stream(std::uint64_t seed, std::uint64_t recording, std::string_view instrument) noexcept {
  std::uint64_t mixed = SplitMix64(seed).next();
  mixed = SplitMix64(mixed ^ recording).next();
  for (const char letter : instrument) mixed = SplitMix64(mixed ^ static_cast<unsigned char>(letter)).next();
  return mixed;
}

}  // namespace emtb::simulated
