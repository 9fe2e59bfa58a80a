#pragma once

#include <Eigen/Core>
#include <cmath>
#include <map>
#include <span>
#include <vector>

#include "analysis/diagnose/likelihood.h"
#include "analysis/diagnose/projection.h"
#include "analysis/fit/residuals.h"
#include "analysis/fit/rotor_phase.h"
#include "analysis/record/record.h"
#include "model/effect.h"
#include "model/model.h"

namespace emtb {

/// One record's residuals of one signal and the fitted model's sensitivities, with the first-order autoregression that
/// whitens them.
struct BaseResiduals {
  Residuals plain;
  double rho = 0;         ///< autocorrelation of the residuals from one reading to the next
  double innovation = 1;  ///< standard deviation of the whitened residuals

  /// Some rows of x, one for each reading, whitened: x[k] - rho x[k-1], in units of `innovation`.
  template <class Matrix>
  Matrix whitened(const Matrix& x, Eigen::Index first, Eigen::Index count) const {
    Matrix y = x.middleRows(first, count);
    const Eigen::Index begin = first == 0 ? 1 : 0;
    y.bottomRows(count - begin) -= rho * x.middleRows(first + begin - 1, count - begin);
    if (begin == 1) y.row(0) *= std::sqrt(1 - rho * rho);  // it has none before it
    y /= innovation;
    return y;
  }
};

/// The fitted model's side of the score test, shared by all candidates: each of them is absent, at its null value.
struct NullFit {
  std::span<const Record> records;
  const Model& model;
  std::vector<RotorPhase> phases;                 ///< of each record
  std::vector<std::vector<BaseResiduals>> bases;  ///< of each record, one a signal
  std::map<Signal, OwnSums> plain;
  OwnSums white;
  Ranges seen;
  Squares left;       ///< of each signal, in all records
  double memory = 0;  ///< [s] of the model's error
  Eigen::Index parameters = 0;

  OwnSums all() const {
    OwnSums sum(parameters);
    for (const auto& [signal, own] : plain) {
      sum.ss += own.ss;
      sum.sr += own.sr;
      sum.readings += own.readings;
    }
    return sum;
  }
};

/// The constants of a fitted model, without what it did in any data.
FittedMachine motor_of(const Model& fitted);

/// How far the fitted model goes in the records; at what frequency it rings is not asked.
Ranges ranges_of(std::span<const Record> records, const Model& fitted);

/// Simulates the fitted model on all records, with sensitivities.
NullFit null_fit(std::span<const Record> records, const Model& fitted);

/// Calls visit(record, o, left, interval) for each speed that was read fast, with what is left of it [rad/s] and the
/// [s] between its readings.
template <class Visit>
void for_each_fast_speed(const NullFit& fitted, const Visit& visit) {
  for (std::size_t i = 0; i < fitted.records.size(); ++i) {
    const Record& record = fitted.records[i];
    for (std::size_t s = 0; s < record.observations.size(); ++s) {
      const Observation& o = record.observations[s];
      if (o.signal != Signal::omega || o.slow || o.size() < 2) continue;
      const Eigen::VectorXd& scaled = fitted.bases[i][s].plain.value;
      std::vector<double> left(scaled.begin(), scaled.end());
      for (std::size_t k = 0; k < left.size(); ++k)
        left[k] *= o.sigma[k];  // a wave is not larger where it is well read
      visit(record, o, std::move(left), record.interval_of(o));
    }
  }
}

}  // namespace emtb
