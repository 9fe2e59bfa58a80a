#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "config/bench.h"
#include "drivers/simulated/plant_port.h"
#include "drivers/simulated/world.h"

namespace emtb::simulated {

/// The plant of a simulated bench with its instruments, in real time behind a PlantPort: what `emtb-plant` runs.
///
/// It outlives the daemon, which a plant within the daemon cannot, and holds the reference meanwhile.
class PlantProcess {
 public:
  /// Told whenever the reference has changed. @param t [s] CLOCK_MONOTONIC when it was seen; @param volts from then on
  using Watch = std::function<void(double t, double volts)>;

  /// @throws ConfigError where the bench has no `simulation.process`, or a device that is not simulated; DeviceError
  /// where another plant has that name.
  explicit PlantProcess(const BenchConfig& bench);

  /// Steps at the bench's rate until `quit`. A step that comes late leaves a gap in the sequence numbers.
  void run(const std::atomic<bool>& quit, const Watch& watch);

 private:
  struct Instrument {
    std::unique_ptr<InputDevice> device;
    PlantPort::Device* port = nullptr;
    bool every_step = false;     // sampled by each step: a step left out is a sample lost
    std::uint64_t left_out = 0;  // samples
  };

  void describe(const std::string& name, Instrument& instrument, PlantPort::Device& port) const;
  void step(std::uint64_t missed) noexcept;

  std::shared_ptr<Clock> clock_;
  std::shared_ptr<World> world_;
  std::vector<Instrument> instruments_;
  PlantMemory memory_;
  double period_;  // [s]
};

}  // namespace emtb::simulated
