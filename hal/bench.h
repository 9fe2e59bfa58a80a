#pragma once

#include <memory>
#include <vector>

#include "hal/analog_output.h"
#include "hal/clock.h"
#include "hal/input_device.h"

namespace emtb {

/// A bench as the loop sees it: what measures, what drives, and what time it is.
struct Bench {
  std::shared_ptr<Clock> clock;
  std::vector<std::unique_ptr<InputDevice>> inputs;
  std::unique_ptr<AnalogOutput> reference;
};

}  // namespace emtb
