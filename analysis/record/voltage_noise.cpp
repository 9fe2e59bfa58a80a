#include "analysis/record/voltage_noise.h"

#include <algorithm>
#include <cmath>

#include "analysis/numerics/scatter.h"

namespace emtb {
namespace {

/// What the bends of voltage and current from reading to reading have in common: a slope has none.
struct Bends {
  double squares = 0;   ///< [V^2] of the voltage
  double products = 0;  ///< [V A] with the current
  double late = 0;      ///< [V A] with the current a reading later
  double current = 0;   ///< [A^2]
  std::size_t count = 0;

  void add(double volts, double amperes, double next) {
    squares += volts * volts;
    products += volts * amperes;
    late += volts * next;
    current += amperes * amperes;
    ++count;
  }
  double slope() const { return products / squares; }  ///< [A/V]
  double error() const {
    return std::sqrt(std::max(0.0, current / squares - slope() * slope()) / static_cast<double>(count));
  }
};

double largest(std::span<const double> values) {
  double size = 0;
  for (const double v : values) size = std::max(size, std::abs(v));
  return size;
}

}  // namespace

bool voltage_hops_alone(std::span<const Run> runs, const Model& model) {
  constexpr double edge = 6;       // standard deviations of a reading
  constexpr double follows = 0.5;  // of what a current does that follows
  constexpr double clear = 2;      // standard errors
  if (model.input != Signal::e_a) return false;
  Bends hops, edges;
  double volts = 0, amperes = 0;
  for (const Run& run : runs) {
    if (!run.has(Signal::e_a) || !run.has(Signal::i_a)) return false;
    const std::vector<double>&e = run.at(Signal::e_a).value, &i = run.at(Signal::i_a).value;
    if (run.at(Signal::i_a).t != run.at(Signal::e_a).t) return false;
    const double sigma = white_noise(e).sigma;
    volts = std::max(volts, largest(e));
    amperes = std::max(amperes, largest(i));
    const auto bend = [](const std::vector<double>& x, std::size_t k) { return x[k + 1] - 2 * x[k] + x[k - 1]; };
    for (std::size_t k = 1; k + 2 < e.size(); ++k) {
      const double volt = bend(e, k);
      (std::abs(volt) > edge * std::sqrt(6.0) * sigma ? edges : hops).add(volt, bend(i, k), bend(i, k + 1));
    }
  }
  if (!(hops.squares > 0) || !(volts > 0)) return false;
  const double at_least = amperes / (2 * volts);
  const double at_edges =
      edges.squares > 0 ? std::max(std::abs(edges.products), std::abs(edges.late)) / edges.squares : at_least;
  return hops.slope() + clear * hops.error() < follows * std::max(at_edges, at_least);
}

}  // namespace emtb
