#include "analysis/check/clipped_voltage.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "analysis/check/readings.h"
#include "analysis/numerics/regression.h"

namespace emtb {

bool motor_takes_more(const Run& run, double value) {
  constexpr std::size_t enough = 50;                  // rows
  constexpr double below = 0.9, by = 0.1, clear = 4;  // of the voltage; of it; of what the rows below scatter
  for (const Signal signal : {Signal::e_a, Signal::i_a, Signal::omega}) {
    if (!run.has(signal) || is_sparse(run, signal)) return false;
  }
  const Series &e_a = run.at(Signal::e_a), &i_a = run.at(Signal::i_a), &omega = run.at(Signal::omega);
  const std::size_t n = e_a.value.size();
  if (i_a.value.size() != n || omega.value.size() != n) return false;  // not of the same rows
  std::vector<std::size_t> standing;
  std::vector<double> current, speed, voltage;  // of the rows below
  for (std::size_t k = 0; k < n; ++k) {
    if (e_a.value[k] == value) {
      standing.push_back(k);
    } else if (std::abs(e_a.value[k]) < below * std::abs(value)) {
      current.push_back(i_a.value[k]);
      speed.push_back(omega.value[k]);
      voltage.push_back(e_a.value[k]);
    }
  }
  if (standing.size() < enough || voltage.size() < enough) return false;
  const Regression motor = regress(std::array{std::move(current), std::move(speed)}, voltage);
  double more = 0;
  for (const std::size_t k : standing) more += motor.value[0] * i_a.value[k] + motor.value[1] * omega.value[k] - value;
  const double asked = more / static_cast<double>(standing.size()) * (value > 0 ? 1 : -1);
  return asked > by * std::abs(value) && asked > clear * motor.scatter;
}

}  // namespace emtb
