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
/// whitens them. All scores hold candidates against them, so they stand for as long as a round of scores takes: the
/// sensitivities with half the digits, the same ones in every sum.
struct BaseResiduals {
  Residuals plain;              ///< its sensitivity is left empty
  Eigen::MatrixXf sensitivity;  ///< as Residuals::sensitivity
  double rho = 0;               ///< autocorrelation of the residuals from one reading to the next
  double innovation = 1;        ///< standard deviation of the whitened residuals

  bool informed() const { return sensitivity.size() > 0; }

  /// Some rows of the sensitivities; none where no parameter moves the signal.
  Eigen::MatrixXd known(Eigen::Index first, Eigen::Index count) const {
    if (!informed()) return {};
    return sensitivity.middleRows(first, count).cast<double>();
  }

  /// The same rows, whitened.
  Eigen::MatrixXd known_white(Eigen::Index first, Eigen::Index count) const {
    if (!informed()) return {};
    const Eigen::Index before = first == 0 ? 0 : 1;
    return whitened(known(first - before, count + before), before, count, first == 0);
  }

  /// Some readings, whitened.
  Eigen::VectorXd left_white(Eigen::Index first, Eigen::Index count) const {
    return whitened(plain.value, first, count, first == 0);
  }

  /// Some rows of x, one for each reading, whitened: x[k] - rho x[k-1], in units of `innovation`.
  /// @param from_start the first of them is the first of all, and has none before it
  template <class Matrix>
  Matrix whitened(const Matrix& x, Eigen::Index first, Eigen::Index count, bool from_start) const {
    Matrix y = x.middleRows(first, count);
    const Eigen::Index begin = from_start ? 1 : 0;
    y.bottomRows(count - begin) -= rho * x.middleRows(first + begin - 1, count - begin);
    if (from_start) y.row(0) *= std::sqrt(1 - rho * rho);
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

/// [s] By how much what lags may do so for how runs of such a row were logged: a row, and what it takes to log one.
/// @param in_itself no timing has its shape: only what a model tells of one
constexpr double logged_lag(double row, bool in_itself) { return (in_itself ? 0.25 : 1.25) * row; }

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
