#pragma once

#include <vector>

#include "hal/input_device.h"
#include "model/model.h"
#include "session/session.h"

namespace emtb {

/// The paper's bench, simulated, and a run in which something begins to rub: apart, since `State` is one thing in the
/// model's catalogue and another in the loop.
struct ChangedBench {
  Model model;
  std::vector<Channel> channels;
  double rate = 0;        ///< [Hz]
  Run run;                ///< friction grows by 0.02 N m ...
  double changed_at = 0;  ///< [s] ... then
};
ChangedBench rubbing_bench();

}  // namespace emtb
