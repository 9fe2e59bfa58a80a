#include "analysis/check/clipped_voltage.h"

#include <cmath>
#include <cstddef>
#include <vector>

#include "analysis/check/readings.h"

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
  std::vector<std::size_t> standing, others;
  for (std::size_t k = 0; k < n; ++k) {
    if (e_a.value[k] == value) {
      standing.push_back(k);
    } else if (std::abs(e_a.value[k]) < below * std::abs(value)) {
      others.push_back(k);
    }
  }
  if (standing.size() < enough || others.size() < enough) return false;

  double ii = 0, iw = 0, ww = 0, ie = 0, we = 0;  // sums of products
  for (const std::size_t k : others) {
    const double i = i_a.value[k], w = omega.value[k], e = e_a.value[k];
    ii += i * i, iw += i * w, ww += w * w, ie += i * e, we += w * e;
  }
  const double determinant = ii * ww - iw * iw;
  if (determinant <= 1e-9 * ii * ww) return false;
  const double R = (ww * ie - iw * we) / determinant, K = (ii * we - iw * ie) / determinant;
  const auto mean = [](const std::vector<std::size_t>& rows, const auto& of) {
    double sum = 0;
    for (const std::size_t k : rows) sum += of(k);
    return sum / static_cast<double>(rows.size());
  };
  const auto more = [&](std::size_t k) { return R * i_a.value[k] + K * omega.value[k] - e_a.value[k]; };
  const double scatter = std::sqrt(mean(others, [&](std::size_t k) { return more(k) * more(k); }));
  const double asked = mean(standing, more) * (value > 0 ? 1 : -1);
  return asked > by * std::abs(value) && asked > clear * scatter;
}

}  // namespace emtb
