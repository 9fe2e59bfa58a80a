#include "analysis/record/reference_row.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "analysis/numerics/even_series.h"
#include "analysis/numerics/parabola.h"
#include "analysis/numerics/parallel.h"
#include "analysis/numerics/statistics.h"
#include "analysis/record/driver_voltage.h"
#include "analysis/record/inputs.h"
#include "analysis/record/repeats.h"

namespace emtb {
namespace {

/// Of a sample: as recorded, read just after the write, and a row later; then eighths of a row, from a row before on.
constexpr std::size_t whole = 3;
constexpr double eighth = 0.125;
constexpr std::array shares{0.0,    -1e-3, 1.0,   -1.0, -0.875, -0.75, -0.625, -0.5, -0.375, -0.25,
                            -0.125, 0.0,   0.125, 0.25, 0.375,  0.5,   0.625,  0.75, 0.875,  1.0};

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

/// The changes of a voltage that are not foreseen: the sum of their squares, and their scatter.
struct Unforeseen {
  double squares = 0, scatter = 0;
};

/// A reference and the terminals that it drives, on its grid.
struct Driven {
  Excitation excitation;
  std::vector<double> measured;
  double least_scatter = 0;  ///< [V] two steps of the meter
};

Driven driven(const Run& run) {
  const Series &reference = run.at(Signal::u_ref), &terminals = run.at(Signal::e_a);
  constexpr double in_full = 1e-9;  // [V] of what is written with all digits
  Driven d;
  d.excitation.t = reference.t;
  d.excitation.u_ref = reference.value;
  d.measured = on_grid(terminals, d.excitation.t, run.name + ": e_a_V");
  d.excitation.initial.e_driver = d.measured.front();
  d.least_scatter = std::max(terminals.lsb / std::sqrt(6.0), in_full);
  return d;
}

/// @param share of a row by which the reference acts later
Unforeseen unforeseen(const Driven& run, const Model& model, double share) {
  Excitation x = run.excitation;
  x.acts_after = share * mean_interval(x.t);
  std::vector<double> changes = unforeseen_changes(run.measured, driver_voltage(model, model.values(), x));
  Unforeseen u;
  for (const double change : changes) u.squares += change * change;
  u.scatter = robust_scatter(std::move(changes));
  return u;
}

/// The sum of squares of the changes that are not foreseen in all runs, for each of the first shares, in units of
/// their scatter in the run.
std::vector<double> costs_of(std::span<const Run* const> runs, const Model& model, std::size_t count) {
  std::vector<Driven> each(runs.size());
  parallel_for(runs.size(), [&](std::size_t k) { each[k] = driven(*runs[k]); });
  std::vector<Unforeseen> of(runs.size() * count);
  parallel_for(of.size(), [&](std::size_t i) { of[i] = unforeseen(each[i / count], model, shares[i % count]); });
  std::vector<double> sum(count, 0);
  for (std::size_t k = 0; k < runs.size(); ++k) {
    const auto its = std::span(of).subspan(k * count, count);
    const double scatter = std::max(std::ranges::min(its, {}, &Unforeseen::scatter).scatter, each[k].least_scatter);
    for (std::size_t i = 0; i < count; ++i) sum[i] += its[i].squares / (scatter * scatter);
  }
  return sum;
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

}  // namespace

bool read_in_every_row(const Run& run, Signal signal, const Model& model) {
  return run.has(signal) && run.at(signal).window <= 0 && run.at(model.input).t.size() >= 10 &&
         run.at(signal).t == run.at(model.input).t && !repeats(run.at(signal).value);
}

bool drives_the_motor(const Run& run, const Model& model) {
  return model.input == Signal::u_ref && run.has(Signal::u_ref) && run.has(Signal::e_a) &&
         2 * run.at(Signal::e_a).t.size() > run.at(Signal::u_ref).t.size() && !repeats(run.at(Signal::e_a).value);
}

double reference_acts_after(std::span<const Run> runs, const Model& model) {
  constexpr double clear = 20;           // of the sum of squares: a nuisance is free, but not for a crumb
  constexpr double much = 0.9;           // of it is left at most: a driver that is slow is not read late
  constexpr double within_noise = 0.97;  // of what noise leaves is left in the best case, by its own scatter
  constexpr double little = 0.2;  // of what noise does not explain is left amid a row: a lag looks like an edge there,
                                  // but leaves more
  std::vector<const Run*> telling;
  double noise = 0;
  for (const Run& run : runs) {
    if (!drives_the_motor(run, model) || run.at(Signal::u_ref).t.size() < 10) continue;
    telling.push_back(&run);
    noise += static_cast<double>(run.at(Signal::u_ref).t.size() - 1);
  }
  if (telling.empty()) return 0;
  const double interval = mean_interval(telling.front()->at(Signal::u_ref).t);
  const auto tells = [&](const std::vector<double>& costs, double cost) {
    return cost <= costs[0] - clear && cost <= much * costs[0];
  };
  std::vector<double> costs = costs_of(telling, model, whole);
  const auto best = std::ranges::min_element(costs);
  if (*best - noise > clear && within_noise * noise < much * costs[0]) {  // what edges amid a row may explain is left
    const std::vector<double> all = costs_of(telling, model, shares.size());
    const double least = std::ranges::min(std::span(all).first(whole));
    const auto amid = std::min_element(all.begin() + whole + 1, all.end() - 1);
    if (*amid - noise < little * (least - noise) && tells(all, *amid))
      return interval * (shares[static_cast<std::size_t>(amid - all.begin())] +
                         eighth * lowest_about(*(amid - 1), *amid, *(amid + 1)));
  }
  return tells(costs, *best) ? interval * shares[static_cast<std::size_t>(best - costs.begin())] : 0;
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
