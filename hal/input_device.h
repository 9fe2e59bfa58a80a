#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hal/clock_estimate.h"
#include "hal/fault.h"
#include "hal/signal.h"

namespace emtb {

/// How a reading comes from what a converter saw: value = scale · raw + offset.
struct Conversion {
  double scale = 0;                        ///< [the signal's unit per unit of raw]; 0: the device does not tell
  double offset = 0;                       ///< [the signal's unit]
  std::string_view unit = "V";             ///< of raw: volts at the input, or what else the device counts in
  bool from_file = false;                  ///< scale and offset are keys of the channel in the bench file
  std::string_view offset_key = "offset";  ///< there
  /// In the file the value stands in a unit of its own: SI = file_unit · value + file_zero.
  double file_unit = 1;
  double file_zero = 0;
};

/// What a device measures on one channel, and how.
struct Channel {
  Signal signal;
  double period = 0;   ///< [s] between readings
  double window = 0;   ///< [s] each reading is the mean over this time before its time stamp; 0: an instant
  double lsb = 0;      ///< resolution in the signal's unit; 0: unknown
  std::string source;  ///< for people and for the session: `daq channel 3`
  double low = -std::numeric_limits<double>::infinity();  ///< the least that it can read, in the signal's unit
  double high = std::numeric_limits<double>::infinity();  ///< and the most; infinite: not known
  Conversion conversion{};
  bool endless = false;  ///< no range bounds it, as of an encoder that counts
};

/// One reading in SI units.
struct Reading {
  Signal signal{};
  double time = 0;             ///< [s] on the loop's clock; end of the window where there is one
  double value = 0;            ///< SI, scaled and offset
  std::uint64_t sequence = 0;  ///< sample number of the channel since start(); a jump is a gap
};

struct Readings {
  std::size_t count = 0;      ///< how many were written to the caller's span
  Fault fault = Fault::none;  ///< why the device cannot be trusted any more
};

/// Anything that measures: a DAQ card that is read at every tick, one that delivers blocks by its own clock, a slow
/// meter.
///
/// No call blocks, throws or allocates after start(): the device's own thread talks to the hardware. One caller at a
/// time.
class InputDevice {
 public:
  virtual ~InputDevice() = default;

  virtual std::span<const Channel> channels() const noexcept = 0;

  /// Begins a recording: empties what is buffered, restarts sample numbers. Called again for each run; not real-time.
  /// @throws DeviceError where the device refuses.
  virtual void start() = 0;

  /// Hands over the readings that arrived since the call before, oldest first; as many as fit, the rest comes next
  /// time.
  virtual Readings read(std::span<Reading> out) noexcept = 0;

  /// The clock by which the device takes its samples, where it has one of its own. From any thread.
  virtual std::optional<ClockEstimate> own_clock() const noexcept { return {}; }
};

}  // namespace emtb
