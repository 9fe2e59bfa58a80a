#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace emtb {

/// Integrates dx/dt = f(t, x) from t0 to t1 by the classical Runge-Kutta method: what the model's own step is judged
/// by.
template <std::size_t N, class F>
std::array<double, N> runge_kutta(const F& f, std::array<double, N> x, double t0, double t1, double longest = 1e-6) {
  const auto steps = static_cast<long>(std::ceil((t1 - t0) / longest - 1e-9));
  const double h = (t1 - t0) / static_cast<double>(steps);
  const auto moved = [](const std::array<double, N>& a, const std::array<double, N>& d, double by) {
    std::array<double, N> y;
    for (std::size_t i = 0; i < N; ++i) y[i] = a[i] + by * d[i];
    return y;
  };
  for (long n = 0; n < steps; ++n) {
    const double t = t0 + static_cast<double>(n) * h;
    const auto k1 = f(t, x);
    const auto k2 = f(t + h / 2, moved(x, k1, h / 2));
    const auto k3 = f(t + h / 2, moved(x, k2, h / 2));
    const auto k4 = f(t + h, moved(x, k3, h));
    for (std::size_t i = 0; i < N; ++i) x[i] += h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
  }
  return x;
}

}  // namespace emtb
