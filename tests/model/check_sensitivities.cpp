#include "tests/model/check_sensitivities.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace emtb {
namespace {

constexpr double part_of_size = 1e-5;  ///< over which differences are taken

using SignalOf = std::vector<double> Trajectory<double>::*;
constexpr std::array<std::pair<const char*, SignalOf>, 5> signals{{{"e_a", &Trajectory<double>::e_a},
                                                                   {"i_a", &Trajectory<double>::i_a},
                                                                   {"omega", &Trajectory<double>::omega},
                                                                   {"theta", &Trajectory<double>::theta},
                                                                   {"torque", &Trajectory<double>::torque}}};

Trajectory<double> simulated(const SensitivityCase& c, std::size_t moved = 0, double by = 0) {
  std::vector<double> values;
  for (const CheckedParameter& p : c.parameters) values.push_back(p.value);
  values[moved] += by;
  Trajectory<double> y;
  simulate<double>(c.structure, values, c.excitation, y);
  return y;
}

struct Sample {
  double at;      ///< in steps from the parameter's value
  double weight;  ///< times 1/step
};

Trajectory<double> combined(const SensitivityCase& c, std::size_t parameter, double step,
                            const std::vector<Sample>& stencil) {
  Trajectory<double> sum;
  sum.resize(c.excitation.t.size());
  for (const auto& [at, weight] : stencil) {
    const Trajectory<double> y = simulated(c, parameter, at * step);
    for (const auto& [name, signal] : signals) {
      for (std::size_t k = 0; k < c.excitation.t.size(); ++k) (sum.*signal)[k] += weight / step * (y.*signal)[k];
    }
  }
  return sum;
}

double largest(const std::vector<double>& x) {
  double m = 0;
  for (const double v : x) m = std::max(m, std::abs(v));
  return m;
}

}  // namespace

Sensitivities model_sensitivities(const SensitivityCase& c) {
  Sensitivities all(c.parameters.size());
  for (std::size_t first = 0; first < c.parameters.size(); first += derivatives_per_pass) {
    const std::size_t count = std::min(derivatives_per_pass, c.parameters.size() - first);
    std::vector<Sensitive> values;
    for (const CheckedParameter& p : c.parameters) values.emplace_back(p.value);
    for (std::size_t j = 0; j < count; ++j) values[first + j].d[j] = 1;
    Trajectory<Sensitive> y;
    simulate<Sensitive>(c.structure, values, c.excitation, y);
    const auto derivative = [](const std::vector<Sensitive>& signal, std::size_t j) {
      std::vector<double> d;
      for (const Sensitive& s : signal) d.push_back(s.d[j]);
      return d;
    };
    for (std::size_t j = 0; j < count; ++j) {
      all[first + j] = {derivative(y.e_a, j), derivative(y.i_a, j), derivative(y.omega, j), derivative(y.theta, j),
                        derivative(y.torque, j)};
    }
  }
  return all;
}

Sensitivities difference_sensitivities(const SensitivityCase& c) {
  Sensitivities all;
  for (std::size_t p = 0; p < c.parameters.size(); ++p) {
    const auto& [name, value, size, min, max] = c.parameters[p];
    const double step = part_of_size * size;
    std::vector<Sample> stencil{{-1, -0.5}, {1, 0.5}};
    if (value - step < min) stencil = {{0, -1.5}, {1, 2}, {2, -0.5}};
    if (value + step > max) stencil = {{0, 1.5}, {-1, -2}, {-2, 0.5}};
    Trajectory<double> d = combined(c, p, step, stencil);
    const Trajectory<double> half = combined(c, p, step / 2, stencil);
    for (const auto& [which, signal] : signals) {
      for (std::size_t k = 0; k < (d.*signal).size(); ++k) {
        (d.*signal)[k] = (4 * (half.*signal)[k] - (d.*signal)[k]) / 3;
      }
    }
    all.push_back(std::move(d));
  }
  return all;
}

testing::AssertionResult agree(const SensitivityCase& c, const Sensitivities& model, const Sensitivities& differences,
                               double tolerance) {
  const Trajectory<double> y = simulated(c);
  testing::AssertionResult failure = testing::AssertionFailure();
  bool fine = true;
  for (std::size_t p = 0; p < c.parameters.size(); ++p) {
    const auto& [parameter, value, size, min, max] = c.parameters[p];
    const double step = part_of_size * size;
    const bool to_one_side = value - step < min || value + step > max;  // its weights magnify rounding four times more
    for (const auto& [name, signal] : signals) {
      const std::vector<double>& a = model[p].*signal;
      const std::vector<double>& b = differences[p].*signal;
      const double rounding = (to_one_side ? 2e-13 : 1e-13) * largest(y.*signal) / step;
      const double allowed = tolerance * largest(b) + rounding;
      for (std::size_t k = 0; k < a.size(); ++k) {
        if (std::abs(a[k] - b[k]) <= allowed) continue;
        failure << "d " << name << "/d " << parameter << " at t = " << c.excitation.t[k] << " s: model " << a[k]
                << ", differences " << b[k] << ", allowed " << allowed << "\n";
        fine = false;
        break;
      }
    }
  }
  return fine ? testing::AssertionSuccess() : failure;
}

testing::AssertionResult CheckSensitivities(const SensitivityCase& c, double tolerance) {
  return agree(c, model_sensitivities(c), difference_sensitivities(c), tolerance);
}

}  // namespace emtb
