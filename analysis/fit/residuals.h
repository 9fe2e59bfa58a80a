#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "analysis/record/record.h"

namespace emtb {

/// Residuals of one signal in one record, (measured - simulated) / sigma, and their sensitivities.
struct Residuals {
  std::size_t record = 0;
  Signal signal{};
  Eigen::VectorXd value;  ///< n
  Eigen::MatrixXd
      sensitivity;  ///< n x p: d(simulated)/dp / sigma; zero columns of a signal that no parameter moves stay 0 x 0

  bool informed() const { return sensitivity.size() > 0; }
};

/// Simulates one record and compares it with each of its observations.
/// @param values all parameters, in the order of the structure, and optionally one more: an angle to add to the rotor's
/// @param moved  for each of the p columns wanted, the places in `values` that this parameter moves (more than one if
/// tied)
std::vector<Residuals> simulated_residuals(const Record& record, const ModelStructure& structure,
                                           std::span<const double> values,
                                           std::span<const std::vector<std::size_t>> moved,
                                           const Variation& variation = {});

/// Called with the number of an observation of the record, that of the first of some readings in a row, and what a
/// Residuals would hold of them.
using VisitReadings = std::function<void(std::size_t observation, Eigen::Index first, const Eigen::VectorXd& value,
                                         const Eigen::MatrixXd& sensitivity)>;

/// The same, handed over as the simulation goes, so that an hour's sensitivities are never held: all readings of each
/// observation in their order; more than 2 * derivatives_per_pass columns are held, and handed over together.
void visit_simulated_residuals(const Record& record, const ModelStructure& structure, std::span<const double> values,
                               std::span<const std::vector<std::size_t>> moved, const VisitReadings& visit);

/// The same at the angle of the rotor that fits best, where the structure holds an effect that repeats with it: see
/// best_phase().
std::vector<Residuals> residuals(std::span<const Record> records, std::size_t record, const ModelStructure& structure,
                                 std::span<const double> values, std::span<const std::vector<std::size_t>> moved);

/// The same for all records, in their order.
std::vector<Residuals> residuals(std::span<const Record> records, const Model& model, std::span<const double> values,
                                 std::span<const std::vector<std::size_t>> moved);

/// In units of sigma^2, over all records and signals.
double sum_of_squares(std::span<const Residuals> residuals);

/// Mean square of the residuals of each signal over all records, in units of the noise floor: 1 where the model is
/// right.
std::map<Signal, double> mean_squares(std::span<const Residuals> residuals);

/// The error of the contract: sqrt(mean over signals of (RMSE/sigma)^2), each signal counting equally. 1 = noise floor.
double error_of(const std::map<Signal, double>& mean_squares);

/// [s] The length of the shortest pieces whose residuals count as independent: as much time in all as a hundred and
/// twenty-eight of them last. A share, not a number of seconds: a large machine moves a thousand times slower than a
/// small one.
template <class Records>
double shortest_piece(const Records& records) {
  constexpr double pieces = 128;
  double seconds = 0;
  for (const Record& record : records) seconds += record.excitation.t.back() - record.excitation.t.front();
  return seconds > 0 ? seconds / pieces : 1;
}

/// Calls visit(piece, begin, rows) for each group of neighbouring readings that end in the same piece of their record.
/// @param first of the `count` readings that are asked @param length [s] of a piece
template <class Visit>
void for_each_piece(const Record& record, const Observation& o, Eigen::Index first, Eigen::Index count, double length,
                    const Visit& visit) {
  const SharedColumn<double>& t = record.excitation.t;
  const auto piece_of = [&](Eigen::Index i) {
    return std::lround(std::floor((t[o.last[static_cast<std::size_t>(i)]] - t.front()) / length));
  };
  for (Eigen::Index begin = first, end = first; begin < first + count; begin = end) {
    const long piece = piece_of(begin);
    for (end = begin + 1; end < first + count && piece_of(end) == piece;) ++end;
    visit(piece, begin, end - begin);
  }
}

}  // namespace emtb
