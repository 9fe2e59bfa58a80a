#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "drivers/simulated/daq.h"
#include "drivers/simulated/meter.h"
#include "drivers/simulated/plant.h"
#include "experiment/profile.h"
#include "model/model.h"
#include "session/session.h"

namespace emtb::blind {

/// A bench whose plant is known to the test and hidden from what is tested: the plant of the simulated devices, its
/// converters, its noise and its meter, recorded tick by tick as the daemon's loop would. Never the equations of
/// model/.
struct Bench {
  simulated::PlantParameters plant;
  std::vector<simulated::DaqChannel> channels;
  bool slow_meter = false;  ///< i_a by a 2.5 Hz averaging meter
  simulated::MeterSettings meter;
  double rate = 1000;                    ///< [Hz]
  std::vector<Profile> train, held_out;  ///< short, so that a diagnosis takes a second
  Model model;                           ///< the linear model that a user would start from
};

/// The paper's bench: one direction, 22.5 V/s, current by the meter.
Bench slow_bench();

/// A small servo: both directions, 2000 V/s, current on the DAQ.
Bench fast_bench();

/// Runs a profile on the bench, from rest. The same seed gives the same readings.
Run record(const Bench& bench, const Profile& profile, std::uint64_t seed);
std::vector<Run> record(const Bench& bench, const std::vector<Profile>& profiles, std::uint64_t seed);

}  // namespace emtb::blind
