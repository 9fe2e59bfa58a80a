#include "analysis/fit/timing_errors.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "analysis/fit/residuals.h"
#include "analysis/numerics/linear_algebra.h"
#include "analysis/record/dataset.h"
#include "model/lateness.h"

namespace emtb {
namespace {

/// The instruments that may be read a part of a sample late for all that the model says.
std::vector<Signal> of_unknown_lateness(std::span<const Record> records, const Model& model) {
  std::vector<Signal> signals;
  for (const Record& record : records) {
    for (const Observation& o : record.observations) {
      if (o.slow || o.signal == Signal::e_a || says_how_late(model.structure(), o.signal)) continue;
      if (std::ranges::find(signals, o.signal) == signals.end()) signals.push_back(o.signal);
    }
  }
  return signals;
}

/// The timing of a record, with each instrument by so much of a sample later, or earlier where it is late.
Timing shifted(const Record& record, double by) {
  Timing timing{record.excitation.acts_after, record.excitation.e_a_held};
  for (const Observation& o : record.observations) timing.late[o.signal] = o.late + (o.late > by ? -by : by);
  return timing;
}

/// What the records say of parameters and lateness together.
struct Sums {
  Eigen::MatrixXd ss, sd, dd;
};

Sums sums_of(std::span<const Record> records, const Model& model, const std::vector<Signal>& signals) {
  constexpr double by = 0.1;  // of a sample: the prediction is a straight line of it up to where a voltage jumps
  const FreeParameters free(model);
  const std::vector<double> values = model.values();
  const auto p = static_cast<Eigen::Index>(free.size()), n = static_cast<Eigen::Index>(signals.size());
  Sums sums{Eigen::MatrixXd::Zero(p, p), Eigen::MatrixXd::Zero(p, n), Eigen::MatrixXd::Zero(n, n)};
  for (std::size_t i = 0; i < records.size(); ++i) {
    const std::vector<Residuals> now = residuals(records, i, records[i].structure(model), values, moved_by(free));
    Record other = records[i];
    set_timing(std::span(&other, 1), shifted(other, by));
    const std::vector<Residuals> then = residuals(std::span(&other, 1), 0, records[i].structure(model), values, {});
    for (std::size_t k = 0; k < now.size(); ++k) {
      if (now[k].informed()) sums.ss += gram(now[k].sensitivity);
      const auto signal = std::ranges::find(signals, now[k].signal);
      if (signal == signals.end() || records[i].find(now[k].signal)->slow) continue;
      const auto c = signal - signals.begin();
      const double change = other.find(now[k].signal)->late - records[i].find(now[k].signal)->late;
      const Eigen::VectorXd d = (then[k].value - now[k].value) / change;
      sums.dd(c, c) += d.squaredNorm();
      if (now[k].informed()) sums.sd.col(c) += transposed_product(now[k].sensitivity, d);
    }
  }
  return sums;
}

}  // namespace

void widen_by_timing(std::span<const Record> records, Calibration& fit) {
  constexpr double even_chance = 12;  // 1/variance, over a sample
  const std::vector<Signal> signals = of_unknown_lateness(records, fit.model);
  const FreeParameters free(fit.model);
  if (signals.empty() || free.size() == 0 || fit.inflation.size() == 0) return;
  const Sums sums = sums_of(records, fit.model, signals);
  const Eigen::MatrixXd goes_with = solve_normal(sums.ss, sums.sd);
  Eigen::MatrixXd known = (sums.dd - sums.sd.transpose() * goes_with) / std::max(1.0, fit.inflation.maxCoeff());
  known.diagonal().array() += even_chance;
  const Eigen::MatrixXd variance = goes_with * solve_normal(known, Eigen::MatrixXd(goes_with.transpose()));
  for (std::size_t k = 0; k < free.size(); ++k) {
    std::optional<double>& error = fit.model.at(free.places()[k]).std_error;
    const auto i = static_cast<Eigen::Index>(k);
    if (error) error = std::sqrt(*error * *error + std::max(0.0, variance(i, i)));
  }
}

}  // namespace emtb
