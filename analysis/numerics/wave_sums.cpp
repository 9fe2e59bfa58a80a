// Compiled once for each processor (emtb_for_processors() in cmake/EmtbBuild.cmake), which EMTB_PROCESSOR names.
#include "analysis/numerics/wave_sums.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

#ifndef EMTB_PROCESSOR
#define EMTB_PROCESSOR any
#define EMTB_WAVE_SUMS_CHOICE
#endif

namespace emtb {
namespace {

constexpr std::size_t lanes = 4;
using Four = double __attribute__((vector_size(32)));
using FourWhole = std::int64_t __attribute__((vector_size(32)));

struct SineCosine {
  Four sine, cosine;
};

constexpr double farthest = 1e8;  // [rad]

/// Quarter turns are taken off, of pi/2 in three parts of which two have 26 bits: for less than 2^27 quarter turns each
/// product is exact. What is left, within pi/4, is a series of Taylor's.
/// @param x within `farthest`
inline SineCosine sine_cosine(const Four& x) {
  constexpr double quarters = 0.63661977236758134308;  // 2/pi
  constexpr double whole = 6755399441055744.0;         // 1.5 * 2^52: adding it rounds to a whole number
  constexpr double first = 1.5707963109016418, second = 1.5893254712295857e-08, third = 6.123233995736766e-17;
  const Four shifted = x * quarters + whole;
  FourWhole quarter;
  std::memcpy(&quarter, &shifted, sizeof quarter);
  const Four n = shifted - whole;
  const Four r = ((x - n * first) - n * second) - n * third;
  const Four q = r * r;
  Four s = q * (-1.0 / 1307674368000.0) + 1.0 / 6227020800.0;
  s = s * q - 1.0 / 39916800.0;
  s = s * q + 1.0 / 362880.0;
  s = s * q - 1.0 / 5040.0;
  s = s * q + 1.0 / 120.0;
  s = s * q - 1.0 / 6.0;
  s = r + r * q * s;
  Four c = q * (1.0 / 20922789888000.0) - 1.0 / 87178291200.0;
  c = c * q + 1.0 / 479001600.0;
  c = c * q - 1.0 / 3628800.0;
  c = c * q + 1.0 / 40320.0;
  c = c * q - 1.0 / 720.0;
  c = c * q + 1.0 / 24.0;
  c = 1.0 - 0.5 * q + q * q * c;
  const FourWhole odd = (quarter & 1) != 0, back = (quarter & 2) != 0, left = ((quarter + 1) & 2) != 0;
  const Four sine = odd ? c : s, cosine = odd ? s : c;
  return {back ? -sine : sine, left ? -cosine : cosine};
}

/// Four sums side by side.
struct FourSums {
  Four s{}, c{}, ss{}, sc{}, cc{}, y{}, sy{}, cy{};

  void add(const SineCosine& w, const Four& v) {
    s += w.sine;
    c += w.cosine;
    ss += w.sine * w.sine;
    sc += w.sine * w.cosine;
    cc += w.cosine * w.cosine;
    y += v;
    sy += w.sine * v;
    cy += w.cosine * v;
  }
};

double sum_of(const Four& x) { return (x[0] + x[1]) + (x[2] + x[3]); }

}  // namespace

template <>
WaveSums wave_sums_for<Processor::EMTB_PROCESSOR>(std::span<const double> angle, std::span<const double> value,
                                                  double per_turn) {
  FourSums sums;
  const std::size_t n = angle.size(), whole = n - n % lanes;
  for (std::size_t k = 0; k < whole; k += lanes) {
    Four x, y;
    std::memcpy(&x, angle.data() + k, sizeof x);
    std::memcpy(&y, value.data() + k, sizeof y);
    x *= per_turn;
    const FourWhole far = (x > farthest) | (x < -farthest);
    if ((far[0] | far[1] | far[2] | far[3]) != 0) {
      SineCosine w;
      for (std::size_t i = 0; i < lanes; ++i) w.sine[i] = std::sin(x[i]), w.cosine[i] = std::cos(x[i]);
      sums.add(w, y);
    } else {
      sums.add(sine_cosine(x), y);
    }
  }
  WaveSums out{sum_of(sums.s),  sum_of(sums.c), sum_of(sums.ss), sum_of(sums.sc),
               sum_of(sums.cc), sum_of(sums.y), sum_of(sums.sy), sum_of(sums.cy)};
  for (std::size_t k = whole; k < n; ++k) {
    const double s = std::sin(per_turn * angle[k]), c = std::cos(per_turn * angle[k]);
    out.sine += s;
    out.cosine += c;
    out.sine_sine += s * s;
    out.sine_cosine += s * c;
    out.cosine_cosine += c * c;
    out.value += value[k];
    out.sine_value += s * value[k];
    out.cosine_value += c * value[k];
  }
  return out;
}

#ifdef EMTB_WAVE_SUMS_CHOICE
WaveSums wave_sums(std::span<const double> angle, std::span<const double> value, double per_turn) {
#ifdef EMTB_FOR_AVX2
  static const bool avx2 = processor() == Processor::avx2;
  if (avx2) return wave_sums_for<Processor::avx2>(angle, value, per_turn);
#endif
  return wave_sums_for<Processor::any>(angle, value, per_turn);
}
#endif

}  // namespace emtb
