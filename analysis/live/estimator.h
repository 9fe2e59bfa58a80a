#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "analysis/live/change.h"
#include "hal/input_device.h"
#include "hal/signal.h"
#include "model/model.h"

namespace emtb {

/// What is known of a parameter now.
struct LiveParameter {
  std::string name;  ///< `R_a`, `coulomb_friction.T_c`
  std::string unit;
  double value = 0;
  double std_error = 0;   ///< 0 where it is fixed; that of its bounds where nothing has informed it yet
  bool excited = false;   ///< the last seconds told something of it
  bool at_bound = false;  ///< it rests on a bound of the model file, which is then no estimate
  bool fixed = false;     ///< the model file fixes it
};

/// How far one signal is from the model.
struct LiveInnovation {
  Signal signal{};
  double value = 0;       ///< SI, measured less predicted; of a fast signal the mean over a block
  double normalised = 0;  ///< RMS over the last second in units of the noise floor: 1 where the model is right
  double sigma = 0;       ///< SI, the noise floor of `value`
};

/// All that is estimated now.
struct LiveEstimates {
  double t = 0;                           ///< [s] from the start of the run, of the last sample that is in
  std::uint64_t samples = 0;              ///< ticks since the estimator began
  std::uint64_t skipped = 0;              ///< readings that were not finite, or came out of order
  std::uint64_t gaps = 0;                 ///< times that the states had to be found anew within a run
  std::vector<LiveParameter> parameters;  ///< in the order of the model, ties followed
  std::vector<std::string> left_out;      ///< effects of the model that take no part: those that repeat with the angle
  std::map<Signal, double> states;        ///< SI, as the model has them: omega, i_a, e_a
  std::vector<LiveInnovation> innovation;
  /// What the values leave of each signal, over all that is remembered, in units of its noise: 1 where the model is
  /// right.
  std::map<Signal, double> left;
  bool fits = true;  ///< the model explains the readings; else no value is to be trusted, whatever its standard error
  LiveMisfitReport misfit;
};

/// Follows a bench while it runs: the parameters of a model with its effects, recursively, from readings as they come.
///
/// The simulation is that of `model/`, its derivatives those of its dual numbers. Least squares of the output error by
/// Gauss and Newton: residuals and sensitivities of each signal go into sums of fixed size (products of neighbouring
/// blocks among them, so that coloured noise is whitened when the sums are solved, by what colour they then show). The
/// history of the last minute or two is kept, and when the solution has left the point about which the equations were
/// linear, a second simulation follows it from the beginning, some ticks with each new one, until it has caught up.
/// What is older stands as information about the parameters: new information of the same direction halves it a minute,
/// a direction that nothing informs keeps what it has. Why so: docs/decisions/live-estimates.md.
///
/// A slow meter's reading is compared with the mean of the simulated signal over its window. The motor is driven by the
/// measured voltage where there is one, the shaft by the measured torque where that is more than noise. Memory is
/// fixed after construction, work per tick bounded; nothing throws but the constructor.
class LiveEstimator {
 public:
  struct Options {
    double chapter = 60;  ///< [s] of history that is kept at least, in full; up to twice as much
    int catch_up = 30;    ///< ticks of the history that a tick may bring along
    bool misfit = true;   ///< watches for changes, too
  };

  /// @param channels what the bench measures; `u_ref` is given to take() as commanded
  /// @param rate [Hz] of the ticks
  /// @throws ModelError where the bench lacks the model's input, or measures nothing to compare with
  LiveEstimator(const Model& model, std::span<const Channel> channels, double rate, const Options& options);
  LiveEstimator(const Model& model, std::span<const Channel> channels, double rate);
  ~LiveEstimator();

  /// A new run: its times begin at zero again, and its states are unknown.
  /// @param field_on [s] for which the field had been on when it began
  void start_run(double field_on = 0);

  /// A reading, in the order of arrival. @param t [s] from the start of the run; of a mean, the end of its window
  /// A `u_ref` closes the tick: all readings of its time have come before it.
  void take(Signal signal, double t, double value);

  LiveEstimates estimates() const;

  /// Changes of the motor that were noticed since the last call (analysis/live/misfit.h).
  std::vector<LiveChange> news();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace emtb
