#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>

#include "experiment/splitmix64.h"

namespace emtb::blind {

/// What chance decides about a case: the same on every machine for a seed.
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : random_(SplitMix64(seed).next()) {}

  double within(double low, double high) { return low + (high - low) * random_.uniform(); }
  double log_within(double low, double high) { return std::exp(within(std::log(low), std::log(high))); }
  bool chance(double probability) { return random_.uniform() < probability; }
  double sign() { return chance(0.5) ? 1 : -1; }
  double phase() { return within(0, 6.283185307179586); }
  std::size_t below(std::size_t n) { return static_cast<std::size_t>(random_.uniform() * static_cast<double>(n)); }
  double one_of(std::initializer_list<double> values) { return values.begin()[below(values.size())]; }
  std::uint64_t seed() { return random_.next(); }

 private:
  SplitMix64 random_;
};

}  // namespace emtb::blind
