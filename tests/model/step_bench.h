#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string_view>
#include <utility>
#include <vector>

#include "model/catalogue.h"
#include "model/simulation.h"
#include "tests/model/benches.h"

/// A motor of round numbers, and short ways to run it: what the tests of a step share.
namespace emtb::step_bench {

using testing_benches::holds;

/// The small servo, round numbers.
inline constexpr double R = 1.2, K = 0.042, B = 1e-5, J = 6e-5;
inline const std::vector<double> servo{R, K, K, B, J};

inline ModelStructure with(const std::vector<std::string_view>& effects, Signal input = Signal::u_ref) {
  ModelStructure s;
  s.input = input;
  for (const std::string_view id : effects) s.effects.push_back(effect_index(id));
  return s;
}

inline std::vector<double> and_(std::vector<double> values, const std::vector<double>& more) {
  values.insert(values.end(), more.begin(), more.end());
  return values;
}

inline Trajectory<double> run(const ModelStructure& s, const std::vector<double>& values, const Excitation& x) {
  Trajectory<double> y;
  simulate<double>(s, values, x, y);
  return y;
}

/// A constant value of one input over a time.
inline Excitation constant(double seconds, double interval, double value, SharedColumn<double> Excitation::*input) {
  Excitation x = holds(interval, {{seconds, value}});
  x.longest_step = 1;
  std::vector<double> values = std::move(x.u_ref);
  x.u_ref.clear();
  x.*input = std::move(values);
  return x;
}

inline double largest_error(const std::vector<double>& a, const std::vector<double>& b) {
  double m = 0;
  for (std::size_t i = 0; i < a.size(); ++i) m = std::max(m, std::abs(a[i] - b[i]));
  return m;
}

}  // namespace emtb::step_bench
