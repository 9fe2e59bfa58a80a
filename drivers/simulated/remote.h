#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "drivers/simulated/plant_port.h"
#include "hal/analog_output.h"
#include "hal/clock.h"
#include "hal/input_device.h"

namespace emtb::simulated {

/// A device of a plant in a process of its own.
class RemoteInput final : public InputDevice {
 public:
  /// @param wanted what the bench file says that the device measures
  /// @throws DeviceError where no plant answers, or it was started with another bench file.
  RemoteInput(const std::string& process, std::string name, const std::vector<Signal>& wanted,
              std::shared_ptr<const Clock> clock);

  std::span<const Channel> channels() const noexcept override { return channels_; }
  void start() override;
  Readings read(std::span<Reading> out) noexcept override;
  std::optional<ClockEstimate> own_clock() const noexcept override;

 private:
  std::string name_;
  PlantMemory memory_;
  const PlantPort::Device* port_;
  std::shared_ptr<const Clock> clock_;
  std::vector<Channel> channels_;
  std::uint64_t next_ = 0;  // which reading of the port
  std::array<std::uint64_t, signal_count> base_{};
  std::array<bool, signal_count> seen_{};
};

/// The reference of a plant in a process of its own: safe from the moment it is opened.
class RemoteOutput final : public AnalogOutput {
 public:
  /// @throws DeviceError where no plant answers.
  RemoteOutput(const std::string& process, Limits limits, std::shared_ptr<const Clock> clock);

  Fault set(double volts) noexcept override;
  Fault make_safe() noexcept override;
  Limits limits() const noexcept override { return limits_; }

 private:
  PlantMemory memory_;
  Limits limits_;
  std::shared_ptr<const Clock> clock_;
};

}  // namespace emtb::simulated
