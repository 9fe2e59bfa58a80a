#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "config/bench.h"
#include "drivers/simulated/daq.h"
#include "drivers/simulated/meter.h"
#include "drivers/simulated/plant.h"
#include "experiment/profile.h"
#include "session/session.h"

namespace emtb::simulated {

/// A simulated bench without its daemon: the plant and the instruments that look at it.
struct Setup {
  PlantParameters plant;
  std::vector<DaqChannel> channels;
  std::optional<MeterSettings> meter;  ///< in the armature circuit
  double rate = 1000;                  ///< [Hz] of the loop
};

/// The setup of a bench file whose devices are all simulated.
/// @throws ConfigError with file, line and key; where a device is not simulated.
Setup read_setup(const BenchConfig& bench);

/// What a person does at the bench during a run: turns the brake, opens the armature circuit.
struct Operation {
  double t = 0;  ///< [s] from the start of the run
  std::function<void(Plant&)> act;
};

/// Runs a profile from rest, tick by tick as the daemon's loop would, without waiting. The same seed gives the same
/// readings. Where the armature was opened, the run says so: `armature_open`.
/// @param operations in the order of their times
Run record(const Setup& setup, const Profile& profile, std::uint64_t seed, std::span<const Operation> operations = {});

}  // namespace emtb::simulated
