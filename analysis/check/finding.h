#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hal/signal.h"

namespace emtb {

/// What can be wrong with a recording.
enum class Flaw {
  scale,        ///< a factor that another signal, or the model's bounds, contradict
  sign,         ///< a signal counts the other way round
  clipped,      ///< rests at its extreme where it would have gone on
  held,         ///< repeats a value while it should change
  spikes,       ///< single readings far off both neighbours
  gap,          ///< a time without readings
  jitter,       ///< readings come unevenly
  delay,        ///< one of two signals of the same motion is late
  angle_speed,  ///< angle and speed are not of the same motion
  duplicate,    ///< the same readings stand twice
  resolution,   ///< a step of the instrument as coarse as the signal
  rest          ///< nothing moves
};

/// The word of the JSON: `angle_speed`.
std::string_view name_of(Flaw flaw);

/// One thing that is wrong, or worth a remark, in one line.
struct DataFinding {
  std::string run;               ///< as read_runs() names it; empty: all runs together
  std::optional<Signal> signal;  ///< none: the run's rows as such
  Flaw what{};
  double from = 0, to = 0;  ///< [s] in the run
  std::string text;         ///< what it is and what to do
  bool stops = false;       ///< a fit to these data would mean nothing
  bool by_bounds = false;   ///< the model's bounds say so, and may be what is wrong; else the recordings themselves do
};

using DataFindings = std::vector<DataFinding>;

}  // namespace emtb
