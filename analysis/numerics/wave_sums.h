#pragma once

#include <span>

#include "hal/processor.h"

namespace emtb {

/// What the least-squares fit of one wave needs: sums over all readings of the sine and cosine of `per_turn * angle`,
/// of their products, of the values, and of the products with these.
struct WaveSums {
  double sine = 0, cosine = 0;
  double sine_sine = 0, sine_cosine = 0, cosine_cosine = 0;
  double value = 0, sine_value = 0, cosine_value = 0;
};

/// A reading takes 2 ns, in vector registers. Sines are right to 1e-15, and angles beyond some 10^7 turns to what is
/// left of their own digits.
/// @param angle [rad] @param value one for each @param per_turn [1/turn]
WaveSums wave_sums(std::span<const double> angle, std::span<const double> value, double per_turn);

/// As compiled for one processor.
template <Processor>
WaveSums wave_sums_for(std::span<const double> angle, std::span<const double> value, double per_turn);
template <>
WaveSums wave_sums_for<Processor::any>(std::span<const double> angle, std::span<const double> value, double per_turn);
template <>
WaveSums wave_sums_for<Processor::avx2>(std::span<const double> angle, std::span<const double> value, double per_turn);

}  // namespace emtb
