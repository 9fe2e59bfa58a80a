#pragma once

#include <memory>
#include <optional>

#include "config/yaml.h"
#include "drivers/driver.h"
#include "drivers/simulated/daq.h"
#include "drivers/simulated/meter.h"
#include "drivers/simulated/plant.h"
#include "drivers/simulated/scanning_daq.h"
#include "drivers/simulated/world.h"

namespace emtb::simulated {

/// Reads the plant from a bench file's `simulation:`; every part of it may be absent, and is then ideal.
/// @throws ConfigError with file, line and key.
PlantParameters read_plant(const YamlMap& simulation);

/// MonotonicClock at pace 1, else a PacedClock.
std::shared_ptr<Clock> open_clock(const YamlMap& simulation);

std::shared_ptr<World> open_world(const YamlMap& simulation, std::shared_ptr<Clock> clock);

/// The channels of a `simulated_daq`, the settings of a `simulated_meter`. @throws ConfigError with file, line and key.
std::vector<DaqChannel> read_channels(const YamlMap& device);
MeterSettings read_meter(const YamlMap& device);
std::optional<CardClock> read_clock(const YamlMap& device);

/// `simulated_daq`: bits, channels {SIGNAL: {range, bits, noise, correlation, gain, offset}}, clock {ppm, block,
/// jitter} where the card scans by a clock of its own. Input, and output of the reference.
OpenedDevice open_daq(const OpenRequest& request);

/// `simulated_meter`: signal (i_a), period, window, resolution, noise, latency, reads (mean, rms).
OpenedDevice open_meter(const OpenRequest& request);
void check_daq(const OpenRequest& request);
void check_meter(const OpenRequest& request);

}  // namespace emtb::simulated
