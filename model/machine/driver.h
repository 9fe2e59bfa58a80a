#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "model/dual.h"
#include "model/machine/chopper.h"
#include "model/machine/equations.h"
#include "model/slew.h"
#include "model/structure.h"

namespace emtb {

/// The driver: what it makes of the reference, before its load takes a part.
///
///     target = clamp(gain u(t - delay) + offset, min, max);  -fall <= de/dt <= rise;  then a lag
///     e_a    = e - R_o i + V_d exp(-|i|/i_c), or chopped
template <class Scalar>
class Driver {
 public:
  explicit Driver(const DriverModel& known) : known_(&known) {}

  void add(std::size_t effect, std::size_t parameter) { effects_.add(effect, parameter); }

  /// The driver as known; its effects change it in every step.
  void reset(Balance<Scalar>& terms) const {
    terms.gain = Scalar(known_->gain);
    terms.min = Scalar(known_->min);
    terms.max = Scalar(known_->max);
    terms.rise = Scalar(known_->rise);
    terms.fall = Scalar(known_->fall);
    terms.delay = terms.offset = terms.lag = Scalar(0.0);
    terms.output_resistance = terms.light_load_rise = terms.light_load_current = Scalar(0.0);
    terms.chop_period = terms.chop_supply = terms.chop_decay = Scalar(0.0);
    terms.current_limit = Scalar(infinity);
    terms.one_quadrant = terms.lets_go = false;
  }

  /// Where it stands and how fast it moves; settled at the reference, where that is not known. What a lag has not
  /// followed yet stands as far before it as it moves in the lag's time.
  void start(double u_ref, const InitialState& initial, Equations<Scalar>& equations) {
    changes_ = {{-infinity, u_ref}};
    arrived_ = 0;
    forget();
    voltage_ = slewed_ = target_of(u_ref, equations);
    if (!initial.e_driver) return;
    voltage_ = Scalar(*initial.e_driver);
    slewed_ = voltage_ + equations.terms.lag * initial.e_driver_slope;
  }

  bool steady() const { return effects_.steady(); }

  /// Its effects have other parameters from now on.
  void forget() { aims_for_.reset(); }

  /// Where it stands was read at its terminals, where its load takes a part of it.
  void stand_behind_terminals(const Balance<Scalar>& terms, const Scalar& i_a) {
    const Scalar taken = voltage_ - voltage_under(terms, i_a);
    voltage_ += taken;
    slewed_ += taken;
  }

  /// Moves the output over a step. @return its mean
  Scalar follow(double u_ref, double t, double h, Equations<Scalar>& equations) {
    if (effects_.empty()) {  // all is known, nothing has a derivative
      const double target = clamped(known_->gain * u_ref, known_->min, known_->max);
      const Slewed<double> e = slew(value_of(voltage_), target, known_->rise, known_->fall, h);
      voltage_ = Scalar(e.end);
      moved_for_ = e.under_way * h;
      return Scalar(e.mean);
    }
    if (u_ref != changes_.back().u_ref) changes_.push_back({t, u_ref});
    const Scalar mean = slewed_mean(t, h, equations), before = voltage_;
    const Balance<Scalar>& terms = equations.terms;
    if (!any(differs(terms.lag, Scalar(0.0)))) {
      voltage_ = slewed_;
      return mean;
    }
    voltage_ = first_order_lag(terms.lag, h, 2.0 * mean - slewed_, slewed_, before);
    return mean - terms.lag * (voltage_ - before) / h;
  }

  /// [V] The reference that it has seen at the end of the last step, but for its dead zone.
  double asked() const { return asked_; }

  /// [V] at the end of the last step, before its load takes a part.
  const Scalar& voltage() const { return voltage_; }

  /// [s] of the last step, after which its output stood still, but for a lag.
  double moved_for() const { return moved_for_; }

  /// [V] at its terminals, which its own load bends.
  Scalar terminal_voltage(const Balance<Scalar>& terms, const Scalar& i_a, const Scalar& back_emf) const {
    const Scalar e = voltage_under(terms, i_a);
    return chops(terms) ? e + (chopped(voltage_, back_emf, terms) - voltage_) : e;
  }

  /// [V] Before its resistance and the rise at light load.
  Scalar chopped_voltage(const Balance<Scalar>& terms, const Scalar& back_emf) const {
    return chops(terms) ? chopped(voltage_, back_emf, terms) : voltage_;
  }

  /// [V] At its terminals, were it not to chop.
  Scalar voltage_under(const Balance<Scalar>& terms, const Scalar& i_a) const {
    if (effects_.empty()) return voltage_;
    Scalar e = voltage_ - terms.output_resistance * i_a;
    if (any(differs(terms.light_load_rise, Scalar(0.0))) && value_of(voltage_) > 0) {
      e += terms.light_load_rise * exp(-abs(i_a) / terms.light_load_current);
    }
    return e;
  }

 private:
  static bool chops(const Balance<Scalar>& terms) { return any(differs(terms.chop_period, Scalar(0.0))); }

  /// What it makes of a reference in the end.
  Scalar target_of(double u_ref, Equations<Scalar>& equations) {
    Balance<Scalar>& terms = equations.terms;
    reset(terms);
    terms.u = Scalar(u_ref);
    equations.middle.u_ref = u_ref;
    effects_.apply(equations.middle, equations);
    asked_ = value_of(terms.u);
    return clamped(terms.gain * terms.u + terms.offset, terms.min, terms.max);
  }

  /// The mean before the lag. The references that arrive during the step act each from its change on; the delay is what
  /// moves them.
  Scalar slewed_mean(double t, double h, Equations<Scalar>& equations) {
    const Balance<Scalar>& terms = equations.terms;
    Scalar area(0.0), from(0.0);
    moved_for_ = 0;
    const auto drive = [&](double u, const Scalar& until) {
      if (!effects_.steady() || u != aims_for_) {
        target_ = target_of(u, equations);
        aims_for_ = u;
      }
      const Slewed<Scalar> e = slew(slewed_, target_, terms.rise, terms.fall, until - from);
      slewed_ = e.end;
      if (e.under_way > 0) moved_for_ = value_of(from) + e.under_way * value_of(until - from);
      area += e.mean * (until - from);
      from = until;
    };
    while (arrived_ + 1 < changes_.size() && changes_[arrived_ + 1].t + value_of(terms.delay) < t + h) {
      drive(changes_[arrived_].u_ref, (changes_[arrived_ + 1].t - t) + terms.delay);
      ++arrived_;
    }
    drive(changes_[arrived_].u_ref, Scalar(h));
    forget_references();
    return area / h;
  }

  /// A reference that changes all the time would fill the memory of a machine that runs all day.
  void forget_references() {
    constexpr std::size_t many = 64;
    if (arrived_ < many) return;
    changes_.erase(changes_.begin(), changes_.begin() + static_cast<std::ptrdiff_t>(arrived_));
    arrived_ = 0;
  }

  const DriverModel* known_;
  EffectParts<Scalar> effects_;
  Scalar voltage_{};
  Scalar slewed_{};                 ///< [V] before the lag
  Scalar target_{};                 ///< [V] that it moves to,
  std::optional<double> aims_for_;  ///< [V] at this reference; it is the same as long as that stays
  double moved_for_ = 0;
  double asked_ = 0;

  struct Change {
    double t, u_ref;
  };
  std::vector<Change> changes_;  ///< of the reference; kept only where effects may delay them
  std::size_t arrived_ = 0;      ///< the last that the driver has seen
};

}  // namespace emtb
