#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "hal/shared_column.h"
#include "hal/signal.h"

namespace emtb {

/// What one channel recorded: values at their own times, never interpolated. Channels that were read together share
/// their times, see share_times().
struct Series {
  SharedColumn<double> t;        ///< [s] from the start of the run, increasing
  SharedColumn<double> value;    ///< SI, as long as t
  double window = 0;             ///< [s] each value is the mean over this time before it; 0: an instant
  double lsb = 0;                ///< resolution of the instrument in the signal's unit; 0: unknown
  std::string source;            ///< the device and channel, or the file's column
  double begins_anew_after = 0;  ///< [rad] of an angle that was read within a turn, say, and put together (unwind.h)
};

/// No bench reads more, in whatever unit of SI; beyond it sums of squares are no numbers any more.
inline constexpr double largest_reading = 1e30;

/// Something that happened during a session.
struct Event {
  double t = 0;  ///< [s]
  int code = 0;  ///< a Fault's number, or one of `event_code`
  std::string text;
};

/// Codes of events that are not faults.
namespace event_code {
inline constexpr int run = 1;         ///< a run of that name begins
inline constexpr int gap = 2;         ///< samples are missing here
inline constexpr int repaired = 3;    ///< the recording ended abruptly and was repaired
inline constexpr int run_ended = 4;   ///< the run ended as planned
inline constexpr int state = 5;       ///< the loop's state changed, as a black box tells
inline constexpr int figures = 6;     ///< how punctual the loop was in this run
inline constexpr int paused = 7;      ///< the reference is held until a person confirms
inline constexpr int resumed = 8;     ///< somebody did
inline constexpr int unattended = 9;  ///< nobody did in time
inline constexpr int clock = 10;      ///< how a device's clock ran against the loop's
inline constexpr int changed = 11;    ///< the motor stopped being what the run so far had shown
inline constexpr int field = 12;      ///< for how long the field has been on, see field_words()
}  // namespace event_code

/// One experiment with an initial state of its own.
struct Run {
  std::string name;  ///< read_session(): as the file calls it, may be empty; read_runs(): as messages should call it,
                     ///< `steps.csv#a@1:3`
  std::map<Signal, Series> signals;
  double field_on = 0;  ///< [s] for which the field had been on when the run began; 0: it began cold, or nobody knows

  bool has(Signal signal) const { return signals.contains(signal); }
  const Series& at(Signal signal) const { return signals.at(signal); }
  double duration() const;  ///< [s] last time of any signal
};

/// Signals of a run that were read at the same times hold these once, for all.
void share_times(std::map<Signal, Series>& signals);

/// Of the signal of which a run has most.
std::size_t most_readings(const Run& run);

/// A slow meter among faster signals: fewer than half the samples of the fastest signal of the run. Where it has no
/// window, each of its readings is the mean since the reading before it; see window_start().
bool is_sparse(const Run& run, Signal signal);

/// When the mean that reading k stands for began [s]: a window before it, or else at the reading before it. The first
/// reading of all has none before it: it is taken to have lasted as long as the second, from the start of the run at
/// the earliest.
double window_start(const Series& series, std::size_t k);

/// A recorded session: its runs, and what a reader needs to know to repeat it.
struct Session {
  std::vector<Run> runs;
  std::vector<Event> events;
  std::map<std::string, std::string> attributes;  ///< started_utc, profile, bench, operator, note, software ...
  std::string config;                             ///< the bench YAML, whole
  bool complete = true;                           ///< false: the recording ended abruptly
};

}  // namespace emtb
