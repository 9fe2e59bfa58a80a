#pragma once

#include "tests/blind/wide/bench.h"

namespace emtb::blind::wide {

/// Draws loop and runs: one to twelve of steps, ramps, staircases and random levels, each from rest or from the middle
/// of a change. About a third of them judge; one or two more are never handed out.
void draw_experiments(WideBench& bench, Draw& draw);

}  // namespace emtb::blind::wide
