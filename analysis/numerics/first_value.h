#pragma once

#include <cstddef>
#include <optional>
#include <span>

namespace emtb {

/// What a series is where it starts and how fast it changes there, as its first readings tell: the straight line
/// through those of 30 ms, in which the speed of most motors hardly bends, three at the least; fewer where they bend
/// more than they scatter.
struct FirstValue {
  double value = 0, error = 0;        ///< at the start; the error is a bound, not a standard error
  double slope = 0, slope_error = 0;  ///< [1/s]

  bool is_other_than(double expected) const;
  bool may_be_other_than(double expected) const;
  bool moves() const;                    ///< faster than noise makes it seem
  bool may_move() const;                 ///< as fast as noise may make it seem, or faster
  bool may_move_at(double speed) const;  ///< where noise makes it seem slower or faster
};

/// [s] How long the line is, where three readings are closer.
inline constexpr double first_value_within = 0.03;

/// @param t [s] of the readings @param start [s] @param lsb the instrument's step
/// @return none of fewer than three readings
std::optional<FirstValue> first_value(std::span<const double> t, std::span<const double> y, double start, double lsb);

/// The same of what may go far from one reading to the next, as a voltage does: where no line goes through even three
/// readings, the first tells the value, and the next how fast it changes.
std::optional<FirstValue> first_value_of_what_jumps(std::span<const double> t, std::span<const double> y, double start,
                                                    double lsb);

/// So many readings of an input stand before its first change, which may bend all that follows it; all of an input that
/// changes from the start on.
std::size_t end_of_first_hold(std::span<const double> input);

}  // namespace emtb
