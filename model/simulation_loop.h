#pragma once

#include <algorithm>
#include <cmath>

#include "model/catalogue.h"
#include "model/lateness.h"
#include "model/measured_edges.h"
#include "model/simulation.h"
#include "model/step.h"

namespace emtb {

/// What drives a machine, row by row.
class DrivingRows {
 public:
  /// @param angle of the shaft; empty: as simulated
  DrivingRows(const Excitation& x, std::span<const double> angle)
      : x_(x),
        angle_(angle),
        even_((x.t.back() - x.t.front()) / static_cast<double>(std::max<std::size_t>(1, x.t.size() - 1))),
        first_(x.t.size() > 1 ? x.t[1] - x.t[0] : even_) {}

  /// As a run begins.
  StepInput first() const {
    StepInput in{.u_ref = value_at(x_.u_ref, 0),
                 .e_a_mean = value_at(x_.e_a, 0),
                 .e_a_end = value_at(x_.e_a, 0),
                 .i_a = value_at(x_.i_a, 0),
                 .load = value_at(x_.load, 0),
                 .omega = value_at(x_.omega, 0),
                 .omega_end = value_at(x_.omega, 0),
                 .angle_middle = {},
                 .angle_end = {},
                 .angle_pull = {},
                 .angle_integrated = x_.angle_integrated};
    if (!angle_.empty()) in.angle_end = angle_[0];
    in.armature_open = !x_.armature_open.empty() && x_.armature_open[0] != 0;
    return in;
  }

  /// Is the angle measured?
  bool tell_angle() const { return !angle_.empty(); }

  /// [s] On average.
  double even() const { return even_; }

  /// [s] From k to the next. A clock that ticks evenly but for the rounding of its times, or does so between its skips,
  /// ticks evenly: what depends on h alone is computed once.
  double interval(std::size_t k) const {
    const double interval = x_.t[k + 1] - x_.t[k];
    for (const double tick : {even_, first_}) {
      if (std::abs(interval - tick) < 1e-9 * tick) return tick;
    }
    return interval;
  }

  /// How many intervals from k on, k's own among them, are that long.
  std::size_t alike(std::size_t k, double length, std::size_t most) const {
    std::size_t count = 1;
    while (count < most && k + count + 1 < x_.t.size() && interval(k + count) == length) ++count;
    return count;
  }

  /// Does what is held differ between two rows?
  bool change(std::size_t row, std::size_t other) const {
    return value_at(x_.u_ref, row) != value_at(x_.u_ref, other) || value_at(x_.i_a, row) != value_at(x_.i_a, other) ||
           (x_.e_a_held && value_at(x_.e_a, row) != value_at(x_.e_a, other));
  }

  /// What stays from k to the next row.
  void enter(std::size_t k, StepInput& in) const {
    if (!x_.temperature.empty()) in.temperature = x_.temperature[k];
    if (!x_.angle_pull.empty()) in.angle_pull = x_.angle_pull[k];
    in.armature_open = !x_.armature_open.empty() && x_.armature_open[k] != 0;
  }

  /// From k to the next, under the held inputs of a row.
  void take(std::size_t k, std::size_t row, StepInput& in) const {
    take(
        k, row, in, [k](std::span<const double> values) { return 0.5 * (values[k] + values[k + 1]); },
        [k](std::span<const double> values) { return values[k + 1]; });
  }

  /// The same of a part of the interval.
  /// @param begin, end as shares of it
  void take(std::size_t k, std::size_t row, double begin, double end, StepInput& in) const {
    const auto at = [k](double share) {
      return [k, share](std::span<const double> values) { return values[k] + (values[k + 1] - values[k]) * share; };
    };
    take(k, row, in, at(0.5 * (begin + end)), at(end));
  }

 private:
  /// @param middle, end what they tell of a signal that is there
  template <class Middle, class End>
  void take(std::size_t k, std::size_t row, StepInput& in, const Middle& middle, const End& end) const {
    const auto of = [](std::span<const double> values, const auto& part) {
      return values.empty() ? 0.0 : part(values);
    };
    in.u_ref = value_at(x_.u_ref, row);
    in.i_a = value_at(x_.i_a, row);
    in.e_a_mean = x_.e_a_held ? value_at(x_.e_a, row) : of(x_.e_a, middle) + value_at(x_.e_a_bulge, k);
    in.e_a_end = x_.e_a_held ? value_at(x_.e_a, row) : of(x_.e_a, end);
    in.load = of(x_.load, middle);
    in.omega = of(x_.omega, middle);
    in.omega_end = of(x_.omega, end);
    if (angle_.empty()) return;
    in.angle_middle = middle(angle_);
    in.angle_end = end(angle_);
  }

  const Excitation& x_;
  std::span<const double> angle_;
  double even_;   ///< [s] on average
  double first_;  ///< [s] from the first row to the second
};

/// Sees how the shaft turns from row to row, where someone asks.
template <class Scalar>
class ShaftFollower {
 public:
  explicit ShaftFollower(bool asked) : asked_(asked) {}

  void begin(const Machine<Scalar>& machine) {
    if (!asked_) return;
    speed_ = machine.omega;
    angle_ = machine.angle();
  }

  void end(const Machine<Scalar>& machine, double interval) {
    if (!asked_) return;
    const Scalar mean = (machine.angle() - angle_) * (1 / interval);
    course_.interval = interval;
    course_.rise = machine.omega - speed_;
    course_.bow = 6 * (mean - speed_) - 3 * course_.rise;
    course_.bow_current = machine.current_taken_by(course_.bow);
  }

  /// Of the last interval; null where there is none.
  const ShaftCourse<Scalar>* course() const { return course_.interval > 0 ? &course_ : nullptr; }

 private:
  bool asked_;
  Scalar speed_{}, angle_{};
  ShaftCourse<Scalar> course_;
};

/// Sees what instruments read on average from row to row, where someone asks.
template <class Scalar>
class MeansFollower {
 public:
  MeansFollower(bool asked, Machine<Scalar>& machine) : asked_(asked) {
    if (asked) machine.ask_for_means();
  }

  void begin(const Machine<Scalar>& machine) {
    if (!asked_) return;
    of_steps_ = means_ = {};
    angle_ = machine.angle();
    add_off_the_state(machine);
  }

  /// @param h [s] of the last step
  void add(const Machine<Scalar>& machine, double h) {
    if (!asked_) return;
    of_steps_.e_a += h * machine.means().e_a;
    of_steps_.i_a += h * machine.means().i_a;
  }

  void end(const Machine<Scalar>& machine, double interval) {
    if (!asked_) return;
    add_off_the_state(machine);
    means_.e_a += (1 / interval) * of_steps_.e_a;
    means_.i_a += (1 / interval) * of_steps_.i_a;
    means_.omega += (1 / interval) * (machine.angle() - angle_);
  }

  /// Of the last interval; null where there is none.
  const MeanReadings<Scalar>* means() const { return asked_ ? &means_ : nullptr; }

 private:
  /// What the instruments read beside the state goes straight from one end of the row to the other.
  void add_off_the_state(const Machine<Scalar>& machine) {
    means_.i_a += 0.5 * (machine.i_a_reading() - machine.i_a);
    means_.omega += 0.5 * (machine.omega_reading() - machine.omega);
  }

  bool asked_;
  Scalar angle_{};
  MeanReadings<Scalar> of_steps_, means_;
};

/// [s] Of a step.
/// @param even interval of the rows
inline double longest_step_of(const ModelStructure& structure, const Excitation& x, const Variation& variation,
                              double even) {
  const double longest = longest_step_of(structure, x);
  return variation.half_steps ? 0.5 * std::min(even, longest) : longest;
}

/// On from row k, as long as nothing but the sums of the step takes time.
/// @param one_step [s] that an interval may last, to be one @return where that ends
template <class Scalar, class To>
std::size_t go_on_plainly(Machine<Scalar>& machine, const DrivingRows& rows, const PlainDrive& drive, double one_step,
                          std::size_t k, To& reader) {
  PlainRows<Scalar> ahead;
  while (k + 1 < drive.t.size()) {
    const double interval = rows.interval(k);
    if (interval > one_step) break;
    const std::size_t count = rows.alike(k, interval, PlainRows<Scalar>::most);
    machine.step_plainly(drive, k, count, interval, ahead);
    for (std::size_t j = 0; j < count; ++j) {
      reader.read(k + 1 + j, machine.read_plainly(drive, k + j, j, interval, ahead));
    }
    k += count;
  }
  return k;
}

/// The definition of simulate(), compiled for the processor that this source is compiled for; included only where it is
/// instantiated.
/// @param reader a Reader, or what is called alike
template <class Scalar, class To>
void simulate_here(const ModelStructure& structure, std::span<const Scalar> parameters, const Excitation& x, To& reader,
                   const Variation& variation) {
  const std::size_t n = x.t.size();
  if (n == 0) return;
  Machine<Scalar> machine(structure, parameters);
  const DrivingRows rows(x, variation.angle.empty() ? std::span<const double>(x.angle) : variation.angle);
  DriverMove<Scalar> move;
  ShaftFollower<Scalar> shaft(x.reads_shaft_late);
  MeansFollower<Scalar> means(x.reads_means, machine);
  const auto read = [&](std::size_t k, bool moves = false) {
    SimulatedReadings<Scalar> y = machine.readings();
    if (moves) y.move = &move;
    y.course = shaft.course(), y.means = means.means();
    reader.read(k, y);
  };
  StepInput in = rows.first();
  machine.start(x.initial, in);
  read(0);
  const double longest_step = longest_step_of(structure, x, variation, rows.even());
  const double one_step = longest_step * as_good_as_one;
  MeasuredEdges<Scalar> edges(structure, x, rows.even() > one_step);
  // Over a part of the interval from k on, under the held inputs of a row.
  const bool may_stand = keeps_no_past(structure, x);
  const auto advance = [&](std::size_t k, std::size_t row, double from, double until, double interval) {
    bool stands = false;
    Stand<Scalar> stand;
    in_steps(from, until, interval, longest_step, [&](double begin, double end, double h) {
      if (stands) return machine.go_on_alike(in, h), means.add(machine, h);
      rows.take(k, row, begin, end, in);
      edges.tell(machine, begin, end);
      const Scalar driver_before = may_stand ? machine.driver().voltage() : Scalar(0.0);
      machine.step(in, x.t[k] + begin * interval, h);
      means.add(machine, h);
      if (machine.driver_moved_for() > 0) move.until = begin + machine.driver_moved_for() / interval;
      stands = may_stand && machine.stood_still(stand, driver_before);
    });
  };
  const double acts_after = shapes_edges(structure) ? std::min(0.0, x.acts_after) : x.acts_after;
  const bool all_plain = acts_after == 0 && x.rows_early == 0 && !edges.shaped() && !x.reads_circuit_late &&
                         !x.reads_shaft_late && !x.reads_means && !x.e_a_held && x.armature_open.empty();
  const PlainDrive drive{x.t, x.u_ref, x.e_a, x.e_a_bulge};
  for (std::size_t k = 0; k + 1 < n; ++k) {
    if (all_plain && machine.is_plain(rows.tell_angle())) {
      k = go_on_plainly(machine, rows, drive, one_step, k, reader);
      if (k + 1 == n) break;
    }
    const double interval = rows.interval(k);
    rows.enter(k, in);
    const std::size_t own = std::min(k + x.rows_early, n - 1), next = std::min(own + 1, n - 1);
    const bool early = acts_after < 0 && rows.change(own, next),
               late = acts_after >= 0 && k > 0 && rows.change(k - 1, k);
    const double acts = early  ? std::max(0.0, 1 + acts_after / interval)
                        : late ? std::min(1.0, acts_after / interval)
                               : 0;
    const std::size_t row = early ? next : own;  // after that
    const bool asked = x.reads_circuit_late;
    const Scalar speed_before = asked ? machine.omega : Scalar(0.0);
    shaft.begin(machine);
    means.begin(machine);
    const std::size_t row_before = early ? own : k - 1;  // until then
    if (edges.shaped()) edges.look_ahead(machine, k, interval, longest_step, acts, row_before, row);
    if (acts > 0) advance(k, row_before, 0, acts, interval);
    if (asked && acts > 0) move.before = machine.current_taken_by(machine.omega - speed_before) * (1 / acts);
    const Scalar speed_at_edge = asked ? machine.omega : Scalar(0.0);
    move.from = move.until = acts;
    if (acts == 0 && interval <= one_step) {  // nearly all of any run
      rows.take(k, row, in);
      edges.tell(machine, 0, 1);
      machine.step(in, x.t[k], interval);
      means.add(machine, interval);
      if (asked && machine.driver_moved_for() > 0) move.until = machine.driver_moved_for() / interval;
    } else if (acts < 1) {
      advance(k, row, acts, 1, interval);
    }
    if (asked && acts < 1) move.after = machine.current_taken_by(machine.omega - speed_at_edge) * (1 / (1 - acts));
    shaft.end(machine, interval);
    means.end(machine, interval);
    read(k + 1, asked && (early || late || move.until > 0));
  }
}

/// For a scalar that model/simulation_code.h does not name.
template <class Scalar>
void simulate(const ModelStructure& structure, std::span<const Scalar> parameters, const Excitation& x,
              Reader<Scalar>& reader, const Variation& variation) {
  simulate_here(structure, parameters, x, reader, variation);
}

}  // namespace emtb
