#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

namespace emtb {

/// N doubles that the compiler keeps in vector registers. They stand in memory alike for every processor, so that code
/// compiled for one can work on the numbers of code compiled for another: GCC would align them by the registers there
/// are.
template <std::size_t N>
struct VectorOf;
template <>
struct VectorOf<2> {
  using type = double __attribute__((vector_size(16)));
};
template <>
struct VectorOf<4> {
  using type = double __attribute__((vector_size(32)));
};
/// More in several registers of AVX2. (One vector of eight would be split by the compiler, and go through memory: four
/// times slower.)
/// @tparam Low, High the vectors that hold the first `size` and the others
template <class Low, class High, std::size_t size>
class alignas(32) Vectors {
 public:
  Vectors() = default;
  Vectors(const Low& low, const High& high) : low_(low), high_(high) {}
  Vectors(const Vectors& b) : low_(b.low_), high_(b.high_) {}
  Vectors& operator=(const Vectors& b) { return low_ = b.low_, high_ = b.high_, *this; }

  double operator[](std::size_t i) const { return i < size ? low_[i] : high_[i - size]; }
  double& operator[](std::size_t i) {
    return i < size ? reinterpret_cast<double*>(&low_)[i] : reinterpret_cast<double*>(&high_)[i - size];  // may alias
  }

  Vectors& operator+=(const Vectors& b) { return low_ += b.low_, high_ += b.high_, *this; }
  Vectors& operator-=(const Vectors& b) { return low_ -= b.low_, high_ -= b.high_, *this; }
  friend Vectors operator-(const Vectors& a) { return {-a.low_, -a.high_}; }
  friend Vectors operator+(const Vectors& a, const Vectors& b) { return {a.low_ + b.low_, a.high_ + b.high_}; }
  friend Vectors operator-(const Vectors& a, const Vectors& b) { return {a.low_ - b.low_, a.high_ - b.high_}; }
  friend Vectors operator*(const Vectors& a, double b) { return {a.low_ * b, a.high_ * b}; }
  friend Vectors operator*(double a, const Vectors& b) { return {a * b.low_, a * b.high_}; }
  friend auto operator!=(const Vectors& a, const Vectors& b) { return (a.low_ != b.low_) | (a.high_ != b.high_); }

 private:
  Low low_{};
  High high_{};
};
template <>
struct VectorOf<8> {
  using type = Vectors<VectorOf<4>::type, VectorOf<4>::type, 4>;
};
template <>
struct VectorOf<12> {
  using type = Vectors<VectorOf<8>::type, VectorOf<4>::type, 8>;
};
template <>
struct VectorOf<24> {
  using type = Vectors<VectorOf<12>::type, VectorOf<12>::type, 12>;
};

/// A number that carries its derivatives with respect to N parameters: forward-mode automatic differentiation.
///
/// The whole model is written once, as templates over the scalar; run with Dual it yields sensitivities that are exact
/// for the discretised equations. Why this and not perturbed copies or hand-written derivatives:
/// docs/decisions/sensitivities.md. Comparisons look at the value alone, so that a simulation takes the same branches
/// with and without derivatives.
template <std::size_t N>
struct alignas(N < 4 ? 16 : 32) Dual {
  using Gradient = typename VectorOf<N>::type;

  double v = 0;
  Gradient d{};

  Dual() = default;
  Dual(double value) : v(value) {}  // NOLINT: constants enter equations as they are written
  Dual(double value, const Gradient& gradient) : v(value), d(gradient) {}
  // Copied member by member: as a block of bytes it would go through halves of a register, and reading it back as a
  // whole stalls.
  Dual(const Dual& b) : v(b.v), d(b.d) {}
  Dual& operator=(const Dual& b) { return v = b.v, d = b.d, *this; }

  /// The i-th of the N independent parameters.
  static Dual variable(double value, std::size_t i) {
    Dual x(value);
    x.d[i] = 1;
    return x;
  }

  Dual& operator+=(const Dual& b) { return v += b.v, d += b.d, *this; }
  Dual& operator-=(const Dual& b) { return v -= b.v, d -= b.d, *this; }
  Dual& operator*=(const Dual& b) { return *this = *this * b; }

  friend Dual operator-(const Dual& a) { return {-a.v, -a.d}; }
  friend Dual operator+(const Dual& a, const Dual& b) { return {a.v + b.v, a.d + b.d}; }
  friend Dual operator-(const Dual& a, const Dual& b) { return {a.v - b.v, a.d - b.d}; }
  friend Dual operator*(const Dual& a, const Dual& b) { return {a.v * b.v, a.v * b.d + b.v * a.d}; }
  friend Dual operator/(const Dual& a, const Dual& b) {
    const double inverse = 1 / b.v;
    const double q = a.v * inverse;
    return {q, (a.d - q * b.d) * inverse};
  }
  // Against plain numbers: most factors of the model are known constants, and need no derivative.
  friend Dual operator+(const Dual& a, double b) { return {a.v + b, a.d}; }
  friend Dual operator+(double a, const Dual& b) { return {a + b.v, b.d}; }
  friend Dual operator-(const Dual& a, double b) { return {a.v - b, a.d}; }
  friend Dual operator-(double a, const Dual& b) { return {a - b.v, -b.d}; }
  friend Dual operator*(const Dual& a, double b) { return {a.v * b, a.d * b}; }
  friend Dual operator*(double a, const Dual& b) { return {a * b.v, a * b.d}; }
  friend Dual operator/(const Dual& a, double b) { return a * (1 / b); }
  friend Dual operator/(double a, const Dual& b) { return {a / b.v, (-a / (b.v * b.v)) * b.d}; }

  friend bool operator<(const Dual& a, const Dual& b) { return a.v < b.v; }
  friend bool operator>(const Dual& a, const Dual& b) { return a.v > b.v; }

  friend Dual exp(const Dual& a) {
    const double e = std::exp(a.v);
    return {e, e * a.d};
  }
  friend Dual sin(const Dual& a) { return {std::sin(a.v), std::cos(a.v) * a.d}; }
  friend Dual pow(const Dual& a, double exponent) {
    return {std::pow(a.v, exponent), (exponent * std::pow(a.v, exponent - 1)) * a.d};
  }
  friend Dual log(const Dual& a) { return {std::log(a.v), a.d * (1 / a.v)}; }
  friend Dual abs(const Dual& a) { return a.v < 0 ? -a : a; }
};

inline double value_of(double x) { return x; }
template <std::size_t N>
double value_of(const Dual<N>& x) {
  return x.v;
}

/// Where two numbers differ, in their value or a derivative; any() says whether anywhere.
inline bool differs(double a, double b) { return a != b; }
inline bool any(bool where) { return where; }
template <std::size_t N>
auto differs(const Dual<N>& a, const Dual<N>& b) {
  return (a.d != b.d) | -static_cast<long>(a.v != b.v);  // all lanes at once: -1 where true
}
template <class Mask>
requires(sizeof(Mask) > sizeof(long)) bool any(const Mask& where) {
  auto bits = where[0];
  for (std::size_t i = 1; i < sizeof where / sizeof bits; ++i) bits |= where[i];
  return bits != 0;
}

using std::abs;
using std::exp;
using std::log;
using std::pow;
using std::sin;

/// The larger and the smaller of two numbers, with the derivative of the one that is taken.
template <class Scalar>
Scalar larger(const Scalar& a, const Scalar& b) {
  return a < b ? b : a;
}
template <class Scalar>
Scalar smaller(const Scalar& a, const Scalar& b) {
  return b < a ? b : a;
}
template <class Scalar>
Scalar clamped(const Scalar& x, const Scalar& low, const Scalar& high) {
  return smaller(larger(x, low), high);
}

/// x, pulled towards zero by `threshold`: the exact solution of a step with dry friction (Moreau): within the threshold
/// it sticks. A threshold of zero lets everything pass, also the derivative of an x that is zero: the slightest torque
/// moves a free shaft.
template <class Scalar>
Scalar soft_threshold(const Scalar& x, const Scalar& threshold) {
  if (x > threshold) return x - threshold;
  if (x < -threshold) return x + threshold;
  return threshold > Scalar(0.0) ? Scalar(0.0) : x;
}

/// tanh, which is 1 to rounding beyond 20.
template <class Scalar>
Scalar saturation(const Scalar& x) {
  return 1.0 - 2.0 / (exp(2.0 * clamped(x, Scalar(-20.0), Scalar(20.0))) + 1.0);
}

/// exp(-h/tau), and 0 where tau is so short (or not positive) that it and all its derivatives vanish.
template <class Scalar>
Scalar decay(double h, const Scalar& tau) {
  return tau > Scalar(h / 700) ? exp(-h / tau) : Scalar(0.0);  // exp(-700) = 1e-304
}

/// Solves `tau dy/dt = x - y` over a step h, exactly for an x that is linear over the step: y at its end.
template <class Scalar>
Scalar first_order_lag(const Scalar& tau, double h, const Scalar& x0, const Scalar& x1, const Scalar& y0) {
  const Scalar lag = (x1 - x0) / h * tau;  // how far y trails a steady slope
  return x1 - lag + (y0 - x0 + lag) * decay(h, tau);
}

/// An instrument's reading x through such a lag, step after step: it starts settled.
/// @param memory of two: the lagged reading, and what it followed
template <class Scalar>
void lag_reading(const Scalar& tau, double h, std::span<Scalar> memory, Scalar& x) {
  memory[0] = h > 0 ? first_order_lag(tau, h, memory[1], x, memory[0]) : x;
  memory[1] = x;
  x = memory[0];
}

}  // namespace emtb
