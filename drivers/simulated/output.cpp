#include "drivers/simulated/output.h"

#include <algorithm>
#include <cmath>

namespace emtb::simulated {

Output::Output(std::shared_ptr<World> world, Limits limits) noexcept : world_(std::move(world)), limits_(limits) {
  world_->force_reference(limits_.safe);
}

Fault Output::set(double volts) noexcept {
  if (!std::isfinite(volts)) {
    make_safe();
    return Fault::non_finite;
  }
  world_->set_reference(std::clamp(volts, limits_.min, limits_.max));
  return Fault::none;
}

Fault Output::make_safe() noexcept {
  world_->force_reference(limits_.safe);
  return Fault::none;
}

}  // namespace emtb::simulated
