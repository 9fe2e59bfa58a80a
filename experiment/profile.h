#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace emtb {

/// A point of the reference over time.
struct Knot {
  double t = 0;      ///< [s] from the start of the run
  double value = 0;  ///< [V]
};

/// The driver reference over time: linear between knots; two knots at one time are a jump, of which the later holds.
///
/// Before the first knot and after the last, the first and the last value hold.
class Profile {
 public:
  /// @throws ConfigError where there is no knot, a number is not finite, or time runs backwards.
  Profile(std::string name, std::vector<Knot> knots);

  const std::string& name() const noexcept { return name_; }
  std::span<const Knot> knots() const noexcept { return knots_; }

  double duration() const noexcept { return knots_.back().t; }  ///< [s]

  /// The reference [V] at time t [s]. No allocation: the loop calls it.
  double reference(double t) const noexcept;

  /// Lowest and highest reference [V] of the whole profile.
  double min() const noexcept;
  double max() const noexcept;

 private:
  std::string name_;
  std::vector<Knot> knots_;
};

/// Rest, one level held, rest again.
/// @param before, hold, after [s]; level, rest [V]
Profile step(std::string name, double level, double before, double hold, double after, double rest = 0);

/// Rest, up to the level at `rate` [V/s], held, down again at the same rate, rest.
Profile ramp(std::string name, double level, double rate, double before, double hold, double after, double rest = 0);

/// Rest, then each level held in turn, then rest.
Profile staircase(std::string name, std::span<const double> levels, double before, double hold, double after,
                  double rest = 0);

/// A run of more random levels than this is a typing error (`shortest` in milliseconds, say), not an experiment.
inline constexpr double most_levels = 100'000;

/// Rest, then levels drawn evenly from [low, high], each held for a time drawn evenly from [shortest, longest], then
/// rest. The same seed gives the same profile on every machine: times and levels fall on a grid of 1 ms and 1 mV.
/// @param total [s] what all levels together last; the last one is cut to fit
/// @throws ConfigError where a range is upside down, or there would be more than most_levels.
Profile random_steps(std::string name, double low, double high, double shortest, double longest, double before,
                     double total, double after, std::uint64_t seed, double rest = 0);

}  // namespace emtb
