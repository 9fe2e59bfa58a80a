#pragma once

#include <span>

#include "session/session.h"

namespace emtb {

/// The angle of an absolute encoder begins anew with each turn, that of a counter where its bits end. Puts it together
/// as a shaft turns: each reading goes on from the one before it as that one did, or as the speed beside it says, by as
/// many turns more or less as bring it nearest. A shaft may thus turn by more than half a turn from row to row, as long
/// as its speed changes by less. Says so in Series::begins_anew_after.
///
/// Left as it was read: an angle that never jumps by most of its range, and one that stays without a course whatever it
/// is thought to begin anew after, as one that is logged too rarely.
/// @param runs that were logged alike
void unwind_angles(std::span<Run> runs);

}  // namespace emtb
