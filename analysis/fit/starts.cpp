#include "analysis/fit/starts.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "analysis/fit/residuals.h"
#include "analysis/numerics/linear_algebra.h"
#include "analysis/numerics/parallel.h"
#include "model/lateness.h"

namespace emtb {
namespace {

/// May the driver be anywhere at the start?
bool driver_is_free(const Record& record, const Model& model) {
  const DriverModel driver = model.structure().driver;
  const bool at_once = driver.rise >= DriverModel::unlimited && driver.fall >= DriverModel::unlimited &&
                       !shapes_edges(model.structure());
  const bool told = record.find(Signal::e_a) != nullptr && record.excitation.initial.e_driver;  // by its first readings
  return model.input == Signal::u_ref && !at_once && !told;
}

/// A start as a point: the speed, and where it is free the driver's voltage.
class Start {
 public:
  Start(Record& record, const Model& model) : initial_(record.excitation.initial), model_(model), record_(record) {
    const DriverModel driver = model.structure().driver;
    drives_ = driver_is_free(record, model);
    low_ = driver.min, high_ = driver.max;
    const double u = record.excitation.u_ref.empty() ? 0 : record.excitation.u_ref.front();
    settled_ = std::clamp(driver.gain * u, low_, high_);
    fastest_ = std::abs(initial_.omega);
    if (const Observation* o = record.find(Signal::omega)) {
      for (const double v : o->value) fastest_ = std::max(fastest_, std::abs(v));
    }
  }

  Eigen::VectorXd at() const {
    Eigen::VectorXd x(drives_ ? 2 : 1);
    x[0] = initial_.omega;
    if (drives_) x[1] = initial_.e_driver.value_or(settled_);
    return x;
  }
  void set(const Eigen::VectorXd& x) {
    // Where a motor forgets its start before the next reading, no reading but the first tells it, and that by a little:
    // a thousand times the speed would then mend what the model lacks there.
    constexpr double above_all_read = 2;
    initial_.omega = std::clamp(x[0], -above_all_read * fastest_, above_all_read * fastest_);
    if (drives_) initial_.e_driver = std::clamp(x[1], low_, high_);
  }
  /// By how much each is moved to see what that changes.
  Eigen::VectorXd little() const {
    constexpr double share = 1e-3;
    Eigen::VectorXd d(drives_ ? 2 : 1);
    d[0] = share * fastest_;
    if (drives_)
      d[1] = share * std::max({1e-3, std::abs(settled_), std::abs(at()[1]), fastest_ * model_.at(base::K_b).value});
    return d;
  }
  double cost() const { return 0.5 * residual().squaredNorm(); }

  /// What is left, less what the model's free parameters would take of it: they were fitted to other starts, and bent.
  Eigen::VectorXd residual() const {
    Eigen::VectorXd left = joined(residuals(std::span(&record_, 1), model_, model_.values(), {}));
    if (slopes_.cols() == 0) return left;
    return left - slopes_ * taken_of(left);
  }

  /// Half the sum of squares that is left where the parameters have indeed taken it, if that is less than without: the
  /// straight line of residual() may lead beyond their bounds, or to where it no longer holds.
  double cost_once_taken() const {
    const Eigen::VectorXd left = joined(residuals(std::span(&record_, 1), model_, model_.values(), {}));
    const double as_they_are = 0.5 * left.squaredNorm();
    if (slopes_.cols() == 0) return as_they_are;
    const FreeParameters free(model_);
    std::vector<double> values = free.pick(model_.values());
    const Eigen::VectorXd taken = taken_of(left);
    for (std::size_t i = 0; i < values.size(); ++i) {
      const Parameter& p = model_.at(free.places()[i]);
      values[i] = std::clamp(values[i] + taken[static_cast<Eigen::Index>(i)], p.min, p.max);
    }
    const std::vector<Residuals> moved = residuals(std::span(&record_, 1), model_, free.spread(values), {});
    return std::min(as_they_are, 0.5 * joined(moved).squaredNorm());
  }

  /// The driver at places from what the speed induces to where the reference leads: a driver that has arrived stays,
  /// and no slope leads away from there.
  void look_around() {
    constexpr int places = 12;
    if (!drives_) return;
    const Eigen::VectorXd x = at();
    const double induced = model_.at(base::K_b).value * x[0];
    double best = x[1], least = cost();
    for (int i = 0; i < places; ++i) {
      const double e = induced + i * (settled_ - induced) / places;
      set(Eigen::Vector2d(x[0], e));
      if (const double there = cost(); there < least) {
        least = there;
        best = e;
      }
    }
    set(Eigen::Vector2d(x[0], best));
  }

  /// From now on what is left is less what the free parameters would take of it.
  void see_parameters() {
    const FreeParameters free(model_);
    const std::vector<Residuals> all = residuals(std::span(&record_, 1), model_, model_.values(), moved_by(free));
    Eigen::Index n = 0;
    for (const Residuals& r : all) n += r.value.size();
    slopes_.setZero(n, static_cast<Eigen::Index>(free.size()));
    n = 0;
    for (const Residuals& r : all) {
      if (r.informed()) slopes_.middleRows(n, r.value.size()) = r.sensitivity;
      n += r.value.size();
    }
    gram_ = slopes_.transpose() * slopes_;
  }

 private:
  Eigen::VectorXd taken_of(const Eigen::VectorXd& left) const {
    return solve_normal(gram_, Eigen::VectorXd(slopes_.transpose() * left)).col(0);
  }

  static Eigen::VectorXd joined(const std::vector<Residuals>& all) {
    Eigen::Index n = 0;
    for (const Residuals& r : all) n += r.value.size();
    Eigen::VectorXd one(n);
    n = 0;
    for (const Residuals& r : all) {
      one.segment(n, r.value.size()) = r.value;
      n += r.value.size();
    }
    return one;
  }

  InitialState& initial_;
  const Model& model_;
  Record& record_;
  Eigen::MatrixXd slopes_, gram_;  // of the free parameters
  bool drives_ = false;
  double low_ = 0, high_ = 0, settled_ = 0;
  double fastest_ = 0;  ///< [rad/s] that is read, with the start as told by the first readings
};

void descend(Start& start) {
  constexpr int most_steps = 6;
  constexpr double done = 1;  // of half the sum of squares
  Eigen::VectorXd left = start.residual();
  for (int step = 0; step < most_steps; ++step) {
    const Eigen::VectorXd x = start.at(), little = start.little();
    Eigen::MatrixXd slope(left.size(), x.size());
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      Eigen::VectorXd beside = x;
      beside[i] += little[i];
      start.set(beside);
      slope.col(i) = (start.residual() - left) / little[i];
    }
    const Eigen::MatrixXd normal = slope.transpose() * slope;
    const Eigen::VectorXd way = -solve_normal(normal, Eigen::VectorXd(slope.transpose() * left)).col(0);
    const double cost = 0.5 * left.squaredNorm();
    double gained = 0;
    for (double share = 1; share > 0.1 && gained <= 0; share /= 2) {
      start.set(x + share * way);
      const Eigen::VectorXd there = start.residual();
      gained = cost - 0.5 * there.squaredNorm();
      if (gained > 0) left = there;
    }
    if (!(gained > 0)) start.set(x);
    if (!(gained > done)) break;
  }
}

/// @return whether it is another one now, that leaves less by `clear` and a share of what there was
/// @param freely the model's parameters are as free as the start
bool moved_to_where_less_is_left(Record& record, const Model& fitted, bool freely, double clear, double share) {
  InitialState& initial = record.excitation.initial;
  const InitialState before = initial;
  Start start(record, fitted);
  if (freely) start.see_parameters();
  const double cost = start.cost(), once_taken = start.cost_once_taken();
  if (initial.omega == 0) initial.omega = initial.omega_doubt;
  start.look_around();
  descend(start);
  const double least = std::max(clear, share * once_taken);
  if (cost - start.cost() > clear && once_taken - start.cost_once_taken() > least) return true;
  initial = before;
  return false;
}

/// @param takes_part in the fit of the parameters
bool settle(Record& record, const Model& fitted, bool takes_part) {
  constexpr double clear = 10;  // of half the sum of squares: more than two numbers take by chance
  constexpr double most = 0.5;  // of what is left: not what the model lacks
  const InitialState& initial = record.excitation.initial;
  if (initial.omega == 0 && initial.omega_doubt == 0) return false;
  if (moved_to_where_less_is_left(record, fitted, true, clear, 0)) return true;
  // Parameters that few runs tell would take what a start is off by of a run alone, but those of others are given it.
  return !takes_part && moved_to_where_less_is_left(record, fitted, false, clear, most);
}

}  // namespace

bool settle_starts(Dataset& data, const Model& fitted) {
  std::vector<char> changed(data.train.size() + data.held_out.size(), 0);
  parallel_for(changed.size(), [&](std::size_t i) {
    const bool takes_part = i < data.train.size();
    Record& record = takes_part ? data.train[i] : data.held_out[i - data.train.size()];
    changed[i] = settle(record, fitted, takes_part) ? 1 : 0;
  });
  return std::ranges::find(changed, 1) != changed.end();
}

Eigen::Index unknowns_of_start(const Record& record, const Model& model) {
  return record.excitation.initial.omega == 0 ? 0 : driver_is_free(record, model) ? 2 : 1;
}

std::vector<std::vector<Eigen::VectorXd>> slopes_of_start(Record& record, const Model& model) {
  std::vector<std::vector<Eigen::VectorXd>> slopes;
  InitialState& initial = record.excitation.initial;
  if (initial.omega == 0) return slopes;
  const InitialState as_set = initial;
  Start start(record, model);
  const auto left = [&] { return residuals(std::span(&record, 1), model, model.values(), {}); };
  const std::vector<Residuals> now = left();
  const Eigen::VectorXd x = start.at(), little = start.little();
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    Eigen::VectorXd beside = x;
    beside[i] += little[i];
    start.set(beside);
    const std::vector<Residuals> then = left();
    initial = as_set;
    std::vector<Eigen::VectorXd>& of = slopes.emplace_back();
    for (std::size_t k = 0; k < now.size(); ++k) of.emplace_back((then[k].value - now[k].value) / little[i]);
  }
  return slopes;
}

}  // namespace emtb
