#include "analysis/record/reference_row.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "analysis/numerics/even_series.h"
#include "analysis/numerics/statistics.h"
#include "analysis/record/inputs.h"
#include "analysis/record/repeats.h"
#include "model/simulation.h"

namespace emtb {
namespace {

/// Of a sample: as recorded, read just after the write, and a row later; then amid a row.
constexpr std::size_t whole = 3;
constexpr std::array shares{0.0,    -1e-3, 1.0,  -0.875, -0.75, -0.625, -0.5, -0.375, -0.25,
                            -0.125, 0.125, 0.25, 0.375,  0.5,   0.625,  0.75, 0.875};
using Costs = std::array<double, shares.size()>;

/// What the driver's model leaves of the changes of a voltage, from reading to reading.
std::vector<double> unforeseen_changes(std::span<const double> measured, std::span<const double> expected) {
  std::vector<double> changes;
  for (std::size_t k = 1; k < measured.size(); ++k) {
    changes.push_back(measured[k] - measured[k - 1] - (expected[k] - expected[k - 1]));
  }
  return changes;
}

double robust_scatter(std::vector<double> changes) {
  for (double& change : changes) change = std::abs(change);
  return robust_sigma(std::move(changes));
}

/// The sum of squares of the changes that are not foreseen, for each share, in units of their scatter.
Costs costs_of(const Run& run, const Model& model) {
  const Series &reference = run.at(Signal::u_ref), &terminals = run.at(Signal::e_a);
  Excitation x;
  x.t = reference.t;
  x.u_ref = reference.value;
  const std::vector<double> measured = on_grid(terminals, x.t, run.name + ": e_a_V");
  x.initial.e_driver = measured.front();
  const std::vector<double> values = model.values();
  double scatter = infinity;
  Costs costs{};
  for (std::size_t i = 0; i < shares.size(); ++i) {
    x.acts_after = shares[i] * mean_interval(x.t);
    Trajectory<double> driver;
    simulate<double>(model.structure(), values, x, driver);
    const std::vector<double> changes = unforeseen_changes(measured, driver.e_a);
    scatter = std::min(scatter, robust_scatter(changes));
    for (const double change : changes) costs[i] += change * change;
  }
  const double least = std::max(terminals.lsb / std::sqrt(6.0), 1e-9);  // two steps; [V] of what is written in full
  scatter = std::max(scatter, least);
  for (double& cost : costs) cost /= scatter * scatter;
  return costs;
}

/// The share at which a parabola through the costs of a share amid a row and both of its neighbours is lowest.
double lowest_between(const Costs& costs, std::size_t place) {
  const double step = 0.125, at = shares[place];
  const auto cost_at = [&](double share) -> std::optional<double> {
    const auto found = std::ranges::find(shares, share);
    if (found == shares.end()) return std::nullopt;
    return costs[static_cast<std::size_t>(found - shares.begin())];
  };
  const auto before = cost_at(at - step), after = cost_at(at + step);
  if (!before || !after) return at;
  const double bend = *before - 2 * costs[place] + *after;
  return bend > 0 ? at + std::clamp(0.5 * (*before - *after) / bend, -0.5, 0.5) * step : at;
}

/// What the changes of a current leave that do not go with those of a voltage, `rows` rows later.
double unlike(std::span<const double> current, std::span<const double> voltage, std::size_t rows) {
  double ii = 0, iv = 0, vv = 0;
  for (std::size_t k = 1; k + 1 < current.size(); ++k) {
    const double i = current[k] - current[k - 1], v = voltage[k + rows] - voltage[k + rows - 1];
    ii += i * i;
    iv += i * v;
    vv += v * v;
  }
  return vv > 0 ? ii - iv * iv / vv : ii;
}

/// Is a signal read anew at the times of the model's input, all of them? Elsewhere there is nothing to compare row by
/// row.
bool read_in_every_row(const Run& run, Signal signal, const Model& model) {
  return run.has(signal) && run.at(signal).window <= 0 && run.at(model.input).t.size() >= 10 &&
         run.at(signal).t == run.at(model.input).t && rows_an_update(run.at(signal).value) == 1;
}

}  // namespace

bool drives_the_motor(const Run& run, const Model& model) {
  return model.input == Signal::u_ref && run.has(Signal::u_ref) && run.has(Signal::e_a) &&
         2 * run.at(Signal::e_a).t.size() > run.at(Signal::u_ref).t.size() &&
         rows_an_update(run.at(Signal::e_a).value) == 1;
}

double reference_acts_after(std::span<const Run> runs, const Model& model) {
  constexpr double clear = 20;    // of the sum of squares: a nuisance is free, but not for a crumb
  constexpr double much = 0.9;    // of it is left at most: a driver that is slow is not read late
  constexpr double little = 0.2;  // of what noise does not explain is left amid a row: a lag looks like an edge there,
                                  // but leaves more
  Costs costs{};
  double noise = 0;
  const Run* first = nullptr;
  for (const Run& run : runs) {
    if (!drives_the_motor(run, model) || run.at(Signal::u_ref).t.size() < 10) continue;
    if (first == nullptr) first = &run;
    const Costs of_run = costs_of(run, model);
    for (std::size_t i = 0; i < shares.size(); ++i) costs[i] += of_run[i];
    noise += static_cast<double>(run.at(Signal::u_ref).t.size() - 1);
  }
  if (first == nullptr) return 0;
  auto least = std::min_element(costs.begin(), costs.begin() + whole);
  if (const auto amid = std::ranges::min_element(costs); *amid - noise < little * (*least - noise)) least = amid;
  if (*least > costs[0] - clear || *least > much * costs[0]) return 0;
  const auto place = static_cast<std::size_t>(least - costs.begin());
  const double share = place < whole ? shares[place] : lowest_between(costs, place);
  return share * mean_interval(first->at(Signal::u_ref).t);
}

int rows_voltage_is_late(std::span<const Run> runs, const Model& model) {
  constexpr double clearly = 0.5;  // of what is left where both are read at once
  if (model.input == Signal::i_a) return 0;
  double at_once = 0, a_row_late = 0;
  for (const Run& run : runs) {
    if (!run.has(model.input) || !read_in_every_row(run, Signal::e_a, model) ||
        !read_in_every_row(run, Signal::i_a, model)) {
      continue;
    }
    const std::vector<double>& grid = run.at(model.input).t;
    const std::vector<double> voltage = on_grid(run.at(Signal::e_a), grid, run.name + ": e_a_V");
    const std::vector<double> current = on_grid(run.at(Signal::i_a), grid, run.name + ": i_a_A");
    at_once += unlike(current, voltage, 0);
    a_row_late += unlike(current, voltage, 1);
  }
  return a_row_late < clearly * at_once ? 1 : 0;
}

}  // namespace emtb
