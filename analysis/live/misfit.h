#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "analysis/live/change.h"
#include "analysis/live/change_test.h"
#include "analysis/live/change_watch.h"
#include "analysis/live/half_seconds.h"
#include "analysis/live/pass.h"
#include "analysis/live/residual_map.h"
#include "analysis/live/rest_readings.h"
#include "analysis/live/unknowns.h"
#include "model/model.h"

namespace emtb {

/// Watches for the moment at which a motor stops being what it was, and says what changed.
///
/// A simulation of its own, beside the live estimator's, with parameters that stay: those that the run has taught so
/// far. Its rows r = sᵀu + noise, u the unknowns (the free parameters; a few effects that the model lacks, at their
/// null), are kept by half-seconds, and each moment of the last ten seconds is tested for a change (ChangeTest). What
/// crosses five standard errors, and stays there, is told (ChangeWatch): what explains most, what cannot be told apart
/// from it, and the size.
///
/// Information counts for as much as the scatter of the half-seconds before allows: noise with a colour, and what the
/// model never explained, are no change. Once told, the size is followed for some seconds; then the motor counts as
/// what it has become.
///
/// Memory is fixed after construction, but for what linear algebra of a dozen unknowns takes twice a second. Not
/// thread-safe.
class LiveMisfit final : private LiveRows {
 public:
  /// @param model without effects that repeat with the angle. @param plan of the estimator
  LiveMisfit(const Model& model, const LivePlan& plan);

  /// Takes the next tick of the estimator's history, as LivePass::advance().
  bool advance(const std::vector<LiveChapter>& history, std::size_t end);
  void forget_chapter() { pass_.forget_chapter(); }

  /// The noise floor of each output, as the estimator has it. @param of_gauge [N m] noise of a reading of the torque
  void set_noise(const std::vector<NoiseColour>& colours, double of_gauge);

  /// The estimator found better values, in the order of the model. Taken while the motor is not known yet.
  void learn(std::span<const double> values);

  LiveMisfitReport report() const;

  /// Changes that were noticed since the last call.
  std::vector<LiveChange> news() { return watch_.news(); }

 private:
  void take(const LiveRow& row) override;
  double trust(std::size_t output, const Eigen::VectorXd& s) const;
  void see_at_rest(const LiveRow& row);
  void forget();
  void close_half_second();
  bool runs_evenly(const HalfSecond& half) const;
  void retire_oldest();
  LiveEquations equations(std::span<const LagSums> outputs) const;
  Timeline timeline() const;
  ChangeTest test() const;
  ChangeScore most_likely_change(const Timeline& time, double& highest) const;
  void look_for_change();
  void notice_load(const Timeline& time);
  void follow_change();
  void settle_into_change();
  void move_point(const Eigen::VectorXd& d);
  LiveChange change_of(const ChangeScore& found) const;

  WatchedUnknowns unknowns_;
  const std::size_t ticks_of_half_;  ///< a half-second
  LivePass pass_;
  std::vector<NoiseColour> colours_, latest_colours_;  ///< that are used, and the latest: a change spoils those
  double load_noise_ = 0;                              ///< [N m] of a measured load, as far as the motor follows it
  bool loaded_ = false;                                ///< the gauge has shown loads, whatever else is learnt anew
  LiveReach reach_;
  RestReadings at_rest_;
  std::optional<std::size_t> moved_in_;  ///< the last run in which it did

  // What is known of the unknowns, from their point.
  const LiveEquations zero_;
  LiveEquations prior_, known_;  ///< known: the prior, and what a motor was before it changed
  HalfSeconds rows_;
  ScoreScatter scatter_;
  Eigen::VectorXd expected_;  ///< where the unknowns of the model are

  std::size_t ticks_ = 0;  ///< of the open half-second
  double t_before_ = 0;    ///< [s]
  std::size_t run_ = 0;
  /// The motor is known: what it has done so far is followed once more, for what was linear about the values of the
  /// first seconds says wrong things with small errors of directions in which little is told.
  bool follow_anew_ = false;

  ChangeWatch watch_;
  std::vector<LiveSuspect> points_to_;
  LiveResidualMap by_speed_, by_current_;
  Eigen::VectorXd scaled_, scaled_before_;  ///< of take()
};

}  // namespace emtb
