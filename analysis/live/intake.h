#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "analysis/live/history.h"
#include "analysis/live/measured_load.h"
#include "analysis/live/noise_floor.h"
#include "analysis/live/plan.h"
#include "analysis/live/voltage.h"
#include "hal/input_device.h"

namespace emtb {

/// Readings as they arrive, made into the ticks and the meters' windows of a history: with the voltage that drives the
/// motor, and the load that the gauge shows, less their noise as far as it can be.
class LiveIntake {
 public:
  struct Counts {
    std::uint64_t samples = 0;  ///< ticks
    std::uint64_t skipped = 0;  ///< readings that were not finite, or came out of order
    std::uint64_t gaps = 0;     ///< ticks after a hole
  };

  /// @param plan, history are kept. @param has_driver the model knows one
  LiveIntake(const LivePlan& plan, std::span<const Channel> channels, bool has_driver, LiveHistory& history);

  /// A new run: its times begin at zero again. @param field_on [s] for which the field had been on
  void start_run(double field_on);

  /// A reading. @param t [s] from the start of the run. @return whether it closed a tick, which a `u_ref` does
  bool take(Signal signal, double t, double value);

  const Counts& counts() const { return counts_; }
  /// Of a slow output. SI
  double sigma_of_meter(Signal signal) const { return meters_[index(signal)].sigma(); }
  /// [N m] noise of a reading of the torque.
  double gauge_noise() const { return load_.noise(); }

 private:
  struct Reading {
    Signal signal;
    double t, value;
  };

  bool close_tick(double t, double u_ref);
  void attach_waiting(double newest);
  void complete(LiveTick& tick, double interval);
  void take_slow(std::size_t output, double t, double value);

  const LivePlan& plan_;
  const std::vector<Channel> channels_;
  LiveHistory& history_;

  std::vector<Reading> waiting_;                  ///< for the tick that they belong to
  std::array<double, signal_count> last_slow_{};  ///< [s] where the window of the next one begins
  std::array<MeterFloor, signal_count> meters_;
  LiveVoltage voltage_;
  MeasuredLoad load_;
  double last_t_ = 0, last_u_ref_ = 0;
  bool new_run_ = true;
  double field_on_ = 0;
  Counts counts_;
};

}  // namespace emtb
