#pragma once

#include <functional>
#include <string_view>

#include "experiment/profile.h"
#include "hal/bench.h"

namespace emtb::replay {

/// A recorded run in the place of a bench.
struct Replay {
  Bench bench;                     ///< its reference output is connected to nothing
  Profile profile;                 ///< the recorded u_ref
  std::function<void(bool)> play;  ///< whether the run is on; for the loop's thread
};

/// @param session `PATH[#RUN][@T0:T1]`, .csv, .h5 or .mat
/// @param period [s] of the loop
/// @param pace times real time; infinity: as fast as it goes
/// @throws SessionError where it cannot be read, or holds several runs of which none is named.
Replay open(std::string_view session, const Limits& reference, double period, double pace);

}  // namespace emtb::replay
