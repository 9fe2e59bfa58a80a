#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "model/dual.h"

namespace emtb {

/// The rival of Dual in docs/decisions/sensitivities.md: W simulations side by side, one a lane, with perturbed
/// parameters.
template <std::size_t W>
class Lanes {
 public:
  using Register = VectorOf<4>::type;

  Lanes() = default;
  Lanes(double x) { parts_.fill(Register{} + x); }  // NOLINT: as Dual

  double operator[](std::size_t i) const { return parts_[i / 4][i % 4]; }
  double& operator[](std::size_t i) { return reinterpret_cast<double*>(&parts_[i / 4])[i % 4]; }

  /// f of the registers of several numbers, register by register.
  template <class F, class... More>
  static Lanes each(const F& f, const More&... x) {
    Lanes y;
    for (std::size_t r = 0; r < W / 4; ++r) y.parts_[r] = f(x.parts_[r]...);
    return y;
  }

  friend Lanes operator-(const Lanes& a) {
    return each([](Register x) { return -x; }, a);
  }
  friend Lanes operator+(const Lanes& a, const Lanes& b) {
    return each([](Register x, Register y) { return x + y; }, a, b);
  }
  friend Lanes operator-(const Lanes& a, const Lanes& b) {
    return each([](Register x, Register y) { return x - y; }, a, b);
  }
  friend Lanes operator*(const Lanes& a, const Lanes& b) {
    return each([](Register x, Register y) { return x * y; }, a, b);
  }
  friend Lanes operator/(const Lanes& a, const Lanes& b) {
    return each([](Register x, Register y) { return x / y; }, a, b);
  }

 private:
  std::array<Register, W / 4> parts_{};
};

template <std::size_t W>
Lanes<W> abs(const Lanes<W>& a) {
  return Lanes<W>::each([](typename Lanes<W>::Register x) { return x < 0 ? -x : x; }, a);
}
template <std::size_t W>
double value_of(const Lanes<W>& a) {
  return a[0];
}
template <std::size_t W>
Lanes<W> clamped(const Lanes<W>& x, const Lanes<W>& low, const Lanes<W>& high) {
  using Register = typename Lanes<W>::Register;
  return Lanes<W>::each(
      [](Register a, Register l, Register h) {
        const Register above = a < l ? l : a;
        return h < above ? h : above;
      },
      x, low, high);
}
template <std::size_t W>
Lanes<W> soft_threshold(const Lanes<W>& x, const Lanes<W>& threshold) {
  return x - clamped(x, -threshold, threshold);
}
template <std::size_t W>
Lanes<W> decay(double h, const Lanes<W>& tau) {
  Lanes<W> e;
  for (std::size_t i = 0; i < W; ++i) e[i] = decay(h, tau[i]);
  return e;
}

}  // namespace emtb
