#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "model/catalogue.h"
#include "model/dual.h"
#include "model/effect.h"
#include "model/machine/equations.h"
#include "model/structure.h"

namespace emtb {

/// [rad] Of what repeats fastest with the angle; 0 where nothing does.
template <class Scalar>
double shortest_period(const ModelStructure& structure, std::span<const Scalar> p) {
  double most = 0;  // times a turn
  std::size_t place = ModelStructure::base_count;
  for (const std::size_t effect : structure.effects) {
    const EffectInfo& info = effect_catalogue()[effect];
    const auto order = info.place_of(Role::order);
    if (info.periodic) most = std::max({most, 1.0, order ? value_of(p[place + *order]) : 1.0});
    place += info.parameter_count;
  }
  return most > 0 ? 2 * std::numbers::pi / most : 0;
}

/// The angle of the rotor as what repeats with it sees it: simulated, or measured by a sensor whose angle wanders.
template <class Scalar>
class RotorAngle {
 public:
  /// @param turned [rad] added to the angle at the start, and to a measured one
  explicit RotorAngle(const Scalar& turned) : turned_(turned) {}

  /// @param period [rad] of the fastest wave; 0: nothing repeats
  void start(double theta, double period, const StepInput& in) {
    theta_ = turned_ + theta;
    lead_ = Scalar(0.0);
    period_ = period;
    measured_ = Scalar(in.angle_end.value_or(0));
    behind_ = Scalar(0.0);
  }

  /// [rad] as simulated.
  const Scalar& theta() const { return theta_; }

  /// What effects see of it in the middle of a step. What holds the shaft to a place keeps it from wandering: where a
  /// measured angle does, the simulated one is better there.
  void see_in_middle(const StepInput& in, double h, const Scalar& omega, State<Scalar>& x) const {
    const Scalar simulated = theta_ + 0.5 * h * omega;
    x.theta = !in.angle_middle ? simulated
              : in.angle_pull  ? turned_ + measured_ + lead_ + 0.5 * h * omega
                               : turned_ + *in.angle_middle + behind_;
    x.place = in.angle_integrated ? simulated : x.theta;
  }

  void see_at_end(const StepInput& in, State<Scalar>& x) const {
    x.theta = at_end(in);
    x.place = in.angle_integrated ? theta_ : x.theta;
  }

  Scalar at_end(const StepInput& in) const { return in.angle_end ? turned_ + *in.angle_end + behind_ + lead_ : theta_; }

  /// @param theta [rad] as simulated, of which no measured angle is to know
  void turn_to(const Scalar& theta) { theta_ = theta; }

  /// @param way [rad] over the step
  void advance(const StepInput& in, double h, const Scalar& way) {
    theta_ += way;
    if (!in.angle_end) return;
    const Scalar angle = *in.angle_end + behind_;
    if (in.angle_pull && period_ > 0) {
      lead_ = (lead_ + way - (angle - measured_)) * (1 / (1 + h * *in.angle_pull));
      lead_ -= period_ * std::round(value_of(lead_) / period_);  // another wave is as good
    }
    measured_ = angle;
  }

  /// What the sensors do puts a measured angle behind the rotor's by so much [rad].
  void put_behind(const Scalar& behind) { behind_ = behind; }

 private:
  Scalar theta_{};
  Scalar turned_{};
  Scalar lead_{};      ///< [rad] of the simulated rotor over a measured angle that wanders
  Scalar measured_{};  ///< [rad] at the end of the last step
  Scalar behind_{};
  double period_ = 0;
};

}  // namespace emtb
