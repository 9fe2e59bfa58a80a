#pragma once

#include "hal/fault.h"

namespace emtb {

/// [V]
struct Limits {
  double min = 0;
  double max = 0;
  double safe = 0;  ///< where the output goes when anything is wrong
};

/// One analog output, e.g. the 0-6 V driver reference.
///
/// Never blocks: the device's own thread talks to the hardware. One writer at a time; make_safe() from any thread.
class AnalogOutput {
 public:
  virtual ~AnalogOutput() = default;

  /// Sets the output.
  /// @param volts clamped to limits() here, below every caller; not finite: refused with Fault::non_finite, output
  /// safe.
  /// @return Fault::none, or why the device cannot be trusted any more.
  virtual Fault set(double volts) noexcept = 0;

  /// Drives the output to its safe value by the shortest way, whatever state the device is in.
  virtual Fault make_safe() noexcept = 0;

  virtual Limits limits() const noexcept = 0;  ///< [V] from the bench file
};

}  // namespace emtb
