#pragma once

#include <optional>

#include "config/bench.h"
#include "hal/analog_output.h"
#include "hal/fault.h"
#include "hal/input_device.h"

namespace emtb {

/// What dropped the reference: the fault, and the reading that showed it where there is one.
struct Trip {
  Fault fault = Fault::none;
  std::optional<Signal> signal;
  double value = 0;  ///< of the signal in its unit, or what the fault counts

  explicit operator bool() const noexcept { return fault != Fault::none; }
};

/// Decides whether the reference may move, and how far. Pure: no device, no clock, no thread.
///
/// Software alone does not make a bench safe: the driver's enable belongs on a hardware interlock with an emergency
/// stop.
class Safety {
 public:
  /// @param rate [V/s] largest change of the reference; 0: unlimited
  Safety(const BenchConfig::SafetyLimits& limits, const Limits& reference, double rate) noexcept
      : limits_(limits), reference_(reference), rate_(rate) {}

  /// Starts latched: nothing moves before somebody armed it.
  bool armed() const noexcept { return armed_; }

  /// Why it is latched; none: not armed since the start.
  const Trip& cause() const noexcept { return cause_; }

  /// Latches. The first cause stays: what follows is usually its consequence.
  /// @return true where this is that first cause
  bool trip(const Trip& trip) noexcept;

  /// Forgets the cause, still latched: whoever calls looks whether it stands before calling arm().
  void clear() noexcept;
  void arm() noexcept { armed_ = !cause_; }

  /// The limit that a reading exceeds, or none.
  Trip judge(const Reading& reading) const noexcept;

  /// @param t [s] since the run began
  Trip judge_run_time(double t) const noexcept;

  /// The reference [V] that may be set instead of `wanted`: within the limits, and no faster than the rate from
  /// `previous` in `dt` [s]. Not finite: the safe value.
  double shape(double wanted, double previous, double dt) const noexcept;

  double safe() const noexcept { return reference_.safe; }  ///< [V]

 private:
  BenchConfig::SafetyLimits limits_;
  Limits reference_;
  double rate_;
  bool armed_ = false;
  Trip cause_;
};

}  // namespace emtb
