#pragma once

#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "model/catalogue.h"
#include "model/model.h"
#include "session/session.h"
#include "tests/model/reference.h"

namespace emtb::synthetic {

inline Parameter parameter(std::string symbol, double value, double min, double max, std::string unit) {
  return {.symbol = std::move(symbol),
          .unit = std::move(unit),
          .value = value,
          .min = min,
          .max = max,
          .fixed = false,
          .prior = {},
          .std_error = {}};
}

/// A small servo as one would guess it; the truth is in Truth.
inline Model servo_model() {
  Model m;
  m.name = "servo";
  m.driver = DriverModel{.gain = 4, .rise = 2000, .fall = 2000, .min = -24, .max = 24};
  m.tie = {{"K_m", "K_b"}};
  m.base = {parameter("R_a", 1, 0.2, 6, "ohm"), parameter("K_b", 0.04, 0.005, 0.3, "V s/rad"),
            parameter("K_m", 0.04, 0.005, 0.3, "N m/A"), parameter("B", 2e-5, 0, 1e-3, "N m s/rad"),
            parameter("J", 5e-5, 5e-6, 1e-3, "kg m2")};
  return m;
}

/// What the recordings are made of: equations of their own, integrated by Runge-Kutta.
struct Truth {
  double R_a = 1.2, K_b = 0.042, K_m = 0.042, B = 1.2e-5, J = 6e-5;
};

struct Hold {
  double seconds, u_ref;
};

/// White noise, the same on every machine for a seed.
class Noise {
 public:
  explicit Noise(unsigned seed) : random_(seed) {}
  double operator()(double sigma) { return sigma * normal_(random_); }

 private:
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
};

/// First-order coloured noise of standard deviation 1.
inline std::vector<double> coloured(std::size_t n, double rho, unsigned seed) {
  Noise noise(seed);
  std::vector<double> x{noise(1)};
  while (x.size() < n) x.push_back(rho * x.back() + noise(std::sqrt(1 - rho * rho)));
  return x;
}

struct Sigma {
  double omega = 0, i_a = 0, e_a = 0;
};

inline void add_reading(Run& run, Signal signal, double t, double value) {
  run.signals[signal].t.push_back(t);
  run.signals[signal].value.push_back(value);
}

/// Records u_ref, e_a, i_a and omega at a rate, from rest.
inline Run record(const Truth& p, const std::vector<Hold>& plan, double interval, const Sigma& sigma = {},
                  unsigned seed = 1) {
  constexpr double longest = 1e-4, gain = 4, slew = 2000, limit = 24;
  Run run;
  run.name = "synthetic";
  for (const Signal s : {Signal::u_ref, Signal::e_a, Signal::i_a, Signal::omega}) run.signals[s] = {};
  Noise noise(seed);
  double t = 0, e = 0, omega = 0;
  const auto read = [&](double u) {
    const auto add = [&](Signal s, double value) { add_reading(run, s, t, value); };
    add(Signal::u_ref, u);
    add(Signal::e_a, e + noise(sigma.e_a));
    add(Signal::i_a, (e - p.K_b * omega) / p.R_a + noise(sigma.i_a));
    add(Signal::omega, omega + noise(sigma.omega));
  };
  std::size_t k = 0;
  for (const Hold& hold : plan) {
    const double target = std::min(std::max(gain * hold.u_ref, -limit), limit);
    for (auto n = static_cast<std::size_t>(std::lround(hold.seconds / interval)); n > 0; --n) {
      read(hold.u_ref);
      const double e0 = e, t0 = t;
      const auto voltage = [&](double at) {  // slews, then holds
        const double way = slew * (at - t0);
        return target > e0 ? std::min(target, e0 + way) : std::max(target, e0 - way);
      };
      t = static_cast<double>(++k) * interval;
      omega = runge_kutta<1>(
          [&](double at, const std::array<double, 1>& x) {
            return std::array{(p.K_m * (voltage(at) - p.K_b * x[0]) / p.R_a - p.B * x[0]) / p.J};
          },
          {omega}, t0, t, longest)[0];
      e = voltage(t);
    }
  }
  return run;
}

inline const std::vector<Hold> steps{{0.2, 0}, {0.6, 2}, {0.6, -3}, {0.6, 5}, {0.6, 0.5}, {0.4, 0}};

/// A series from a function of time.
inline Series series(double interval, double seconds, const std::function<double(double)>& f) {
  Series s;
  for (std::size_t k = 0; static_cast<double>(k) * interval < seconds - 1e-9; ++k) {
    s.t.push_back(static_cast<double>(k) * interval);
    s.value.push_back(f(s.t.back()));
  }
  return s;
}

}  // namespace emtb::synthetic
