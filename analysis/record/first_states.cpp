#include "analysis/record/first_states.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "analysis/numerics/even_series.h"
#include "analysis/numerics/first_value.h"
#include "analysis/record/driver_voltage.h"
#include "analysis/record/repeats.h"

namespace emtb {
namespace {

/// A mean over a row or two tells how a run begins as an instant does; one over many rows, or of a slow meter, does
/// not.
bool tells_the_start(const Observation* o, std::span<const double> grid) {
  constexpr double few = 2;  // rows
  if (o == nullptr) return false;
  return !o->slow || (2 * o->size() >= grid.size() && o->window > 0 && o->window <= few * mean_interval(grid));
}

/// Of the readings that lie before a grid point. @param tell first_value(), or what knows of jumps
std::optional<FirstValue> first_value_of(const Observation& o, std::span<const double> grid, std::size_t end,
                                         decltype(first_value)& tell = first_value) {
  std::vector<double> times;
  for (std::size_t i = 0; i < o.size() && o.last[i] < end; ++i) {
    times.push_back(0.5 * (grid[o.first[i]] + grid[o.last[i]]));
    if (times.size() > 2 && times.back() > grid.front() + first_value_within) break;
  }
  return tell(times, std::span(o.value).first(times.size()), grid.front(), o.lsb);
}

/// So many rows of a series lie before the first change of the input.
/// @param end so many grid points lie before it
std::size_t rows_before(const Series& series, std::span<const double> grid, std::size_t end) {
  return static_cast<std::size_t>(std::ranges::upper_bound(series.t, grid[end - 1]) - series.t.begin());
}

/// The first angles of an encoder: they begin with the run, where the readings of a speed that is their slope begin in
/// the middle of the first line, and a small servo is at full speed by then.
/// @param end so many grid points lie before the first change of the input
std::optional<FirstValue> first_angle(const Run& run, std::span<const double> grid, std::size_t end) {
  const auto found = run.signals.find(Signal::theta);
  if (found == run.signals.end()) return std::nullopt;
  const Series& theta = found->second;
  const std::size_t before = rows_before(theta, grid, end);
  const std::span<const double> t = std::span(theta.t).first(before), value = std::span(theta.value).first(before);
  std::optional<FirstValue> first = first_value(t, value, grid.front(), theta.lsb);
  // As long as nothing is counted, it turns by less than a count.
  const auto moves = std::ranges::find_if(value, [&](double angle) { return angle != value.front(); });
  const auto standing = static_cast<std::size_t>(moves - value.begin());
  if (!first || !(theta.lsb > 0) || standing <= 3 * rows_an_update(theta.value)) return first;
  const double least = theta.lsb / (t[standing - 1] - t.front());
  if (least < first->slope_error) {
    first->slope = 0;
    first->slope_error = least;
  }
  return first;
}

/// The same of the rows of a file, where each reading stands in several: fewer than three of them may lie before the
/// first change.
std::optional<FirstValue> first_value_of_rows(const Series& series, std::span<const double> grid, std::size_t end) {
  const std::size_t before = rows_before(series, grid, end);
  return first_value(std::span(series.t).first(before), std::span(series.value).first(before), grid.front(),
                     series.lsb);
}

/// Where angles are coarse, a few of them do not tell a shaft that turns from one that rests. A tachogenerator that
/// they contradict reads a speed at rest, or none of a shaft that turns.
void set_first_speed(InitialState& initial, const Observation& speed, const Run& run, std::span<const double> grid,
                     std::size_t end) {
  const std::optional<FirstValue> angle = first_angle(run, grid, end);
  if (speed.origin == Origin::slope_of_angle) {
    if (angle && angle->may_move()) (angle->moves() ? initial.omega : initial.omega_doubt) = angle->slope;
    return;
  }
  std::optional<FirstValue> read = first_value_of(speed, grid, end);
  if (!read && !speed.slow) read = first_value_of_rows(run.at(Signal::omega), grid, end);
  if (angle && !(read && angle->may_move_at(read->value))) {
    if (angle->moves()) initial.omega = angle->slope;
  } else if (read && read->may_be_other_than(0)) {
    (read->is_other_than(0) ? initial.omega : initial.omega_doubt) = read->value;
  }
}

/// [V] What the driver of the model makes of a reference in the end.
double settled_driver(double u_ref, const Model& model) {
  Excitation x;
  x.t = {0};
  x.u_ref = {u_ref};
  return driver_voltage(model, model.values(), x).front();
}

/// Does nothing drive the shaft yet? At rest, or far from what a driver that has arrived would turn it by, and where a
/// current is read, without one.
/// @param settled [V] what the driver makes of the first reference in the end
bool begins_undriven(const InitialState& initial, const ObservedRun& observed, std::size_t end, const Model& model,
                     double settled) {
  constexpr double far = 0.2;
  const double induced = model.at(base::K_b).value * initial.omega_doubt;
  const Observation* speed = observed.find(Signal::omega);
  const Observation* current = observed.find(Signal::i_a);
  const std::span<const double> grid = observed.excitation.t;
  if (!tells_the_start(speed, grid) || initial.omega != 0 || !(std::abs(induced) < far * std::abs(settled)))
    return false;
  if (!tells_the_start(current, grid)) return true;
  const auto first = first_value_of(*current, observed.excitation.t, end, first_value_of_what_jumps);
  return first && !first->is_other_than(0);
}

}  // namespace

InitialState first_states(const ObservedRun& observed, const Run& run, const Model& model) {
  const Excitation& x = observed.excitation;
  InitialState initial;
  initial.as_read = true;
  if (const Observation* speed = observed.find(Signal::omega); tells_the_start(speed, x.t)) {
    set_first_speed(initial, *speed, run, x.t, end_of_first_hold(run.at(model.input).value));
  }
  if (const Observation* current = observed.find(Signal::i_a); current != nullptr && !current->slow) {
    initial.i_a = current->value.front();
  }
  const Observation* voltage = observed.find(Signal::e_a);
  if (x.u_ref.empty()) return initial;
  const std::size_t end = end_of_first_hold(x.u_ref);
  const double settled = settled_driver(x.u_ref.front(), model);
  if (tells_the_start(voltage, x.t)) {
    const auto first = first_value_of(*voltage, x.t, end, first_value_of_what_jumps);
    if (first && first->is_other_than(settled)) {
      initial.e_driver = first->value;
      if (first->moves()) initial.e_driver_slope = first->slope;
    }
  } else if (voltage == nullptr && begins_undriven(initial, observed, end, model, settled)) {
    initial.e_driver = 0;  // the reference was set as the run began
  }
  return initial;
}

}  // namespace emtb
