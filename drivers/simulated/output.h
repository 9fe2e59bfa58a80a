#pragma once

#include <memory>

#include "drivers/simulated/world.h"
#include "hal/analog_output.h"

namespace emtb::simulated {

/// The reference of the simulated driver.
class Output final : public AnalogOutput {
 public:
  Output(std::shared_ptr<World> world, Limits limits) noexcept;

  Fault set(double volts) noexcept override;
  Fault make_safe() noexcept override;
  Limits limits() const noexcept override { return limits_; }

 private:
  std::shared_ptr<World> world_;
  Limits limits_;
};

}  // namespace emtb::simulated
