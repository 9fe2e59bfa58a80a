#pragma once

#include <cmath>
#include <cstddef>

#include "model/dual.h"

namespace emtb {

/// W doubles in vector registers, also those that the processor must split.
template <std::size_t W>
struct LaneVector;
template <>
struct LaneVector<4> {
  using type = double __attribute__((vector_size(32)));
};
template <>
struct LaneVector<8> {
  using type = double __attribute__((vector_size(64)));
};

/// The rival of Dual in docs/decisions/sensitivities.md: W simulations side by side, one a lane, with perturbed
/// parameters.
template <std::size_t W>
struct Lanes {
  using Vector = typename LaneVector<W>::type;
  Vector v{};

  Lanes() = default;
  Lanes(double x) : v(Vector{} + x) {}  // NOLINT: as Dual
  Lanes(const Vector& x) : v(x) {}      // NOLINT

  Lanes& operator+=(const Lanes& b) { return v += b.v, *this; }
  friend Lanes operator-(const Lanes& a) { return {-a.v}; }
  friend Lanes operator+(const Lanes& a, const Lanes& b) { return {a.v + b.v}; }
  friend Lanes operator-(const Lanes& a, const Lanes& b) { return {a.v - b.v}; }
  friend Lanes operator*(const Lanes& a, const Lanes& b) { return {a.v * b.v}; }
  friend Lanes operator/(const Lanes& a, const Lanes& b) { return {a.v / b.v}; }
};

template <std::size_t W>
Lanes<W> exp(const Lanes<W>& a) {
  Lanes<W> e;
  for (std::size_t i = 0; i < W; ++i) e.v[i] = std::exp(a.v[i]);
  return e;
}
template <std::size_t W>
Lanes<W> abs(const Lanes<W>& a) {
  return {a.v < 0 ? -a.v : a.v};
}
template <std::size_t W>
double value_of(const Lanes<W>& a) {
  return a.v[0];
}
template <std::size_t W>
Lanes<W> larger(const Lanes<W>& a, const Lanes<W>& b) {
  return {a.v < b.v ? b.v : a.v};
}
template <std::size_t W>
Lanes<W> smaller(const Lanes<W>& a, const Lanes<W>& b) {
  return {b.v < a.v ? b.v : a.v};
}
template <std::size_t W>
Lanes<W> clamped(const Lanes<W>& x, const Lanes<W>& low, const Lanes<W>& high) {
  return smaller(larger(x, low), high);
}
template <std::size_t W>
Lanes<W> soft_threshold(const Lanes<W>& x, const Lanes<W>& threshold) {
  return x - clamped(x, -threshold, threshold);
}
template <std::size_t W>
Lanes<W> decay(double h, const Lanes<W>& tau) {
  Lanes<W> e;
  for (std::size_t i = 0; i < W; ++i) e.v[i] = tau.v[i] > h / 700 ? std::exp(-h / tau.v[i]) : 0;
  return e;
}

}  // namespace emtb
