#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "analysis/live/equations.h"
#include "analysis/live/plan.h"
#include "model/model.h"

namespace emtb {

/// A parameter that may change while the motor runs, of the model or of an effect that it lacks.
struct WatchedParameter {
  std::string name, unit;
  double low = 0, high = 0;       ///< SI bounds
  std::optional<std::size_t> at;  ///< place among the model's parameters; absent: the model lacks its effect
  std::size_t effect = 0;         ///< that the model lacks, where it does
  bool may_change = true;         ///< from one second to the next
  double fixed_to = 0;            ///< SI, standard deviation where the model file fixes it; 0: it does not
  std::optional<Prior> prior;

  bool in_model() const { return at.has_value(); }
};

/// The most that was seen of a motor: the scale of what it lacks.
struct LiveReach {
  double omega = 0;  ///< [rad/s]
  double i_a = 0;    ///< [A]

  void see(double some_omega, double some_i_a);
};

/// The unknowns of the live misfit, and the point from which they are counted: the parameters of the model, free or
/// fixed; a few effects that it lacks, at their null; then what each slow meter's rounding does to a value that stands
/// still.
class WatchedUnknowns {
 public:
  /// @param model without effects that repeat with the angle. @param plan of the estimator
  WatchedUnknowns(const Model& model, const LivePlan& plan);

  /// Of a simulation whose derivatives are by these unknowns.
  const LivePlan& plan() const { return plan_; }
  Eigen::Index size() const { return digits_.size(); }
  /// The first unknowns; those behind them are meters' roundings.
  const std::vector<WatchedParameter>& parameters() const { return parameters_; }
  /// The unknowns of the model as it is, and of its meters.
  const std::vector<Eigen::Index>& of_model() const { return of_model_; }
  /// SI, of a meter whose rounding is the unknown; 0: it is a parameter.
  double digit(Eigen::Index i) const { return digits_[i]; }

  std::size_t inertia() const { return inertia_; }             ///< the unknown that is J
  std::optional<std::size_t> drag() const { return drag_; }    ///< that brakes the shaft, as an error of its load does
  std::optional<std::size_t> gauge() const { return gauge_; }  ///< that is a load which a gauge shows
  double gauge_digit() const { return gauge_digit_; }          ///< [N m]

  /// All parameters of the structure, at the point.
  const std::vector<double>& point() const { return point_; }
  /// SI, of a parameter at the point; what goes into a reading alone has its null there.
  double value(std::size_t j) const { return moves(j) ? point_[plan_.moved[j].front()] : 0; }
  /// Its change moves the simulation, not a reading alone.
  bool moves(std::size_t j) const { return j < plan_.moved.size(); }

  /// The output to which it adds, where it does nothing else.
  std::optional<std::size_t> output_of_reading(std::size_t j) const;

  /// Moves the point, within bounds. @param d of which only the model's own parameters move. @return by what it moved
  Eigen::VectorXd move_point(Eigen::VectorXd d);

  /// What bounds, priors and fixed values say, about the point.
  LiveEquations prior() const;

  /// SI, what is believed of the size of an effect that the model lacks: that it is small, by what the motor has done.
  double believed_size(std::size_t j, const LiveReach& reach) const;

  /// SI, by how much an unknown may differ from one time to another without being worth a word.
  double allowed_drift(std::size_t j, const LiveReach& reach) const;

 private:
  LivePlan plan_;
  std::vector<WatchedParameter> parameters_;
  std::vector<double> point_;
  Eigen::VectorXd digits_;
  std::vector<Eigen::Index> of_model_;
  std::size_t inertia_ = 0;
  std::optional<std::size_t> drag_, gauge_;
  double gauge_digit_ = 0;
};

}  // namespace emtb
