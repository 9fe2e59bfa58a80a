#pragma once

#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "model/lateness.h"
#include "model/simulation.h"
#include "model/step.h"
#include "model/structure.h"

namespace emtb {

/// The value of a row; 0 of a signal that is not there.
inline double value_at(const std::vector<double>& values, std::size_t k) { return values.empty() ? 0.0 : values[k]; }

/// What is longer than the longest step by less than this is one.
inline constexpr double as_good_as_one = 1 + 1e-6;

/// The steps of a part of an interval.
/// @param from, until as shares of it @param step called with where each begins and ends, likewise, and its length [s]
template <class Step>
void in_steps(double from, double until, double interval, double longest_step, const Step& step) {
  const double length = (until - from) * interval;
  const int steps =
      length <= longest_step * as_good_as_one ? 1 : static_cast<int>(std::ceil(length / longest_step - 1e-6));
  for (int s = 0; s < steps; ++s) {
    step(from + (until - from) * s / steps, from + (until - from) * (s + 1) / steps, length / steps);
  }
}

/// How a measured voltage goes on between two readings where an effect shapes the driver's edges, or where rows are so
/// long that a mean over them does not tell when in them an edge comes: as the driver does. What the readings add to
/// that is straight.
template <class Scalar>
class MeasuredEdges {
 public:
  /// @param x must outlive this @param long_rows each is simulated in several steps
  MeasuredEdges(const ModelStructure& structure, const Excitation& x, bool long_rows)
      : x_(x),
        shaped_(structure.measured_voltage && structure.input == Signal::u_ref &&
                (shapes_edges(structure) || long_rows)) {}

  bool shaped() const { return shaped_; }

  /// What the readings at k and the next add to where the driver stands then.
  /// @param acts share of the interval at which the reference of `row` acts, in place of that of `row_before`
  void look_ahead(Machine<Scalar>& machine, std::size_t k, double interval, double longest_step, double acts,
                  std::size_t row_before, std::size_t row) {
    if (ahead_) {
      *ahead_ = machine.driver();  // takes no memory anew
    } else {
      ahead_.emplace(machine.driver());
    }
    Driver<Scalar>& ahead = *ahead_;
    at_begin_ = x_.e_a[k] - ahead.voltage();
    const auto go_on = [&](std::size_t held, double from, double until) {
      in_steps(from, until, interval, longest_step, [&](double begin, double, double h) {
        machine.look_ahead(ahead, value_at(x_.u_ref, held), x_.t[k] + begin * interval, h);
      });
    };
    if (acts > 0) go_on(row_before, 0, acts);
    if (acts < 1) go_on(row, acts, 1);
    at_end_ = x_.e_a[k + 1] - ahead.voltage();
  }

  /// What they add over a part of the interval.
  void tell(Machine<Scalar>& machine, double begin, double end) const {
    if (!shaped_) return;
    const auto at = [this](double share) { return at_begin_ + share * (at_end_ - at_begin_); };
    machine.add_measured({at(begin), at(end)});
  }

 private:
  const Excitation& x_;
  bool shaped_;
  std::optional<Driver<Scalar>> ahead_;
  Scalar at_begin_{}, at_end_{};  ///< [V]
};

}  // namespace emtb
