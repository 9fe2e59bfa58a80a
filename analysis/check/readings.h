#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "analysis/check/finding.h"
#include "session/session.h"

namespace emtb {

/// The instrument's step: as stated, or the smallest change there is; 0 where nothing changes.
double step_of(const Series& series);

/// The same of a speed, or what one count of an encoder makes of it from row to row, where its readings are whole
/// counts over the times between uneven rows.
double step_of_speed(const Series& speed);

/// The noise of a signal that also moves, by second differences of its readings off rest; of an instrument without
/// noise, less than half its step.
/// @param rest what is nearer to zero than this is left out
double noise_of(std::span<const double> x, double rest);

/// How often readings turn back, and how often of that beyond a neighbouring step. A speed from counts hops between two
/// neighbours by itself (to the next but one while it gathers speed), and where the counts are whole it does not.
struct Hops {
  std::size_t turns = 0, far = 0;

  void add(double before, double reading, double after, double step);
  bool beyond_neighbours() const { return static_cast<double>(far) > 0.3 * static_cast<double>(turns); }
};

/// How a signal goes on from reading to reading where it is off rest.
struct Restlessness {
  std::size_t length = 1;  ///< half of the readings stand in stretches at least as long as this
  std::size_t rare = 1;    ///< one stretch in a hundred is longer: where a reading lies amid a step of its instrument
  bool noisy = false;      ///< its noise reaches the next step again and again: a long stretch is none of its own
};

/// @param without readings of this value are left out
Restlessness restlessness(std::span<const double> x, double rest, double step, std::optional<double> without = {});

/// What drives the motor, for asking again and again: how much of a change counts is told once for a run, which may be
/// hours long.
class Drives {
 public:
  /// Which changes count.
  enum class Change { large, any };

  /// @param signal that is looked at: an e_a does not drive itself
  /// @param margin rows around a change within which a signal may change at once
  Drives(const Run& run, Signal signal, Change counts = Change::large, double margin = 3);

  /// Whether one of them changes from the margin before a time to the margin after another [s].
  bool change(double from, double to) const;

 private:
  struct Drive {
    const Series* series;
    double rows;   ///< [s] the margin
    double least;  ///< that counts as a change
  };
  std::vector<Drive> drives_;
};

/// How restless a signal is where what drives it stays: where a controller sends it, it goes without any noise of its
/// own.
Restlessness undriven_restlessness(const Run& run, Signal signal, double rest, std::optional<double> without = {});

/// How restless a signal is by itself: all in all, but of a terminal voltage only where its reference stays.
Restlessness own_restlessness(const Run& run, Signal signal, double rest, std::optional<double> without = {});

/// Whether a signal has one value throughout.
bool constant(const Series& series);

/// Whether a speed or an angle moves, by more than noise and than the instrument's steps: its range is far above that
/// of noise, white or coloured, or its mean over a hundred readings lies once far further off zero than they scatter.
bool moves(const Series& series);

/// The largest absolute value.
double size_of(std::span<const double> x);

/// The signals of a run that are measured, have as many readings as its rows, and are not what a command sets: e_a
/// counts only beside a u_ref.
std::vector<Signal> measured_signals(const Run& run);

/// `omega`.
std::string name_of(Signal signal);

/// A number for a message: three digits.
std::string short_number(double value);

}  // namespace emtb
