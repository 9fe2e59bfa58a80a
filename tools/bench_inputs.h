#pragma once

#include <string>
#include <vector>

#include "drivers/registry.h"

namespace emtb {

/// What a channel read while one looked at it.
struct ChannelSeen {
  std::string device;         ///< its name in the bench file
  Channel channel;            ///< as the device describes it
  std::size_t count = 0;      ///< readings
  double mean = 0;            ///< of the finite ones
  double scatter = 0;         ///< standard deviation
  double lowest = 0;          ///< of all readings
  double highest = 0;         ///< of all readings
  double age = 0;             ///< [s] of the last, at the end
  bool finite = true;         ///< every one of them
  Fault fault = Fault::none;  ///< of the device, when it was last asked

  /// At an end of what the input can tell; 0 V of an input that only goes up from there is where a sensor may well
  /// rest.
  enum class Rail { none, zero, lower, upper };
  Rail rail() const;

  double raw(double value) const { return (value - channel.conversion.offset) / channel.conversion.scale; }
};

/// Reads every channel for so long, and on until each has given something or has been silent for three periods and a
/// second. @param seconds at least
std::vector<ChannelSeen> look_at(BenchInputs& inputs, double seconds);

/// `emtb bench check`: each signal once, in volts and in its unit, with what is odd about it. Nothing moves.
/// @return 0, or 1 where something is wrong
int check_bench(const std::string& file);

struct CalibrateOptions {
  std::string file, signal;
  double seconds = 2;   ///< [s] each point is read
  double arm = 0;       ///< [m] lever of weights, for references in kg; 0: none
  double share = 0.02;  ///< of the references' span by which a point may be off the line
};

/// `emtb bench calibrate`: scale and offset of one signal from references that a person types, written into the bench
/// file.
/// @throws Error where the points make no calibration; the file is then as it was
int calibrate_channel(const CalibrateOptions& options);

}  // namespace emtb
