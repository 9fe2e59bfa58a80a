#include "analysis/fit/residuals.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "analysis/fit/instrument.h"
#include "analysis/fit/rotor_phase.h"

namespace emtb {
namespace {

/// The columns of a sensitivity that one pass fills: `count` from `first` on, of `all`.
struct Columns {
  std::size_t first = 0, count = 0;
  Eigen::Index all = 0;
};

/// Compares a record with its simulation: residuals from values, columns of the sensitivities from derivatives.
template <class Scalar>
class Comparison final : public Reader<Scalar> {
 public:
  Comparison(const Record& record, const ModelStructure& structure, Columns columns, std::vector<Residuals>& out)
      : columns_(columns), out_(out) {
    for (const Observation& o : record.observations) instruments_.emplace_back(o, structure);
  }

  void read(std::size_t k, const SimulatedReadings<Scalar>& y) override {
    for (std::size_t s = 0; s < instruments_.size(); ++s) {
      const Observation& o = instruments_[s].observation();
      instruments_[s].see(k, y, [&](std::size_t reading, const Scalar& predicted) {
        const auto row = static_cast<Eigen::Index>(reading);
        const double weight = 1 / o.sigma[reading];
        out_[s].value.data()[row] = (o.value[reading] - value_of(predicted)) * weight;
        if constexpr (!std::is_same_v<Scalar, double>) fill_row(out_[s], row, predicted, weight);
      });
    }
  }

 private:
  void fill_row(Residuals& r, Eigen::Index row, const Scalar& predicted, double weight) {
    if (!r.informed()) {
      if (!any(differs(predicted, Scalar(value_of(predicted))))) return;  // no derivative yet, perhaps never
      r.sensitivity.setZero(r.value.size(), columns_.all);
    }
    // By pointer: Eigen checks every index, and this is the innermost loop of every fit.
    double* entry = r.sensitivity.data() + static_cast<Eigen::Index>(columns_.first) * r.sensitivity.rows() + row;
    for (std::size_t c = 0; c < columns_.count; ++c, entry += r.sensitivity.rows()) *entry = predicted.d[c] * weight;
  }

  Columns columns_;
  std::vector<Residuals>& out_;
  std::vector<Instrument<Scalar>> instruments_;
};

/// One pass with as many derivatives as the scalar carries.
/// @param values of all parameters, and the angle to turn the rotor by at the start
template <class Scalar>
void pass(const Record& record, const ModelStructure& structure, std::span<const double> values,
          std::span<const std::vector<std::size_t>> moved, const Variation& variation, Columns columns,
          std::vector<Residuals>& out) {
  std::vector<Scalar> p(values.begin(), values.end());
  for (std::size_t j = 0; j < columns.count; ++j) {
    for (const std::size_t place : moved[columns.first + j]) p[place].d[j] = 1;
  }
  Comparison<Scalar> comparison(record, structure, columns, out);
  simulate<Scalar>(structure, p, record.excitation, comparison, variation);
}

/// As many passes as the columns need.
void all_passes(const Record& record, const ModelStructure& structure, std::span<const double> values,
                std::span<const std::vector<std::size_t>> moved, const Variation& variation,
                std::vector<Residuals>& out) {
  if (moved.empty()) {
    Comparison<double> comparison(record, structure, {}, out);
    simulate<double>(structure, values, record.excitation, comparison, variation);
  }
  const auto all = static_cast<Eigen::Index>(moved.size());
  for (std::size_t first = 0; first < moved.size();) {
    const std::size_t left = moved.size() - first;
    if (left > derivatives_per_pass) {
      const Columns columns{first, std::min(left, 2 * derivatives_per_pass), all};
      pass<WideSensitive>(record, structure, values, moved, variation, columns, out);
      first += columns.count;
    } else {
      pass<Sensitive>(record, structure, values, moved, variation, {first, left, all}, out);
      first += left;
    }
  }
}

}  // namespace

std::vector<Residuals> simulated_residuals(const Record& record, const ModelStructure& structure,
                                           std::span<const double> values,
                                           std::span<const std::vector<std::size_t>> moved,
                                           const Variation& variation) {
  std::vector<Residuals> out;
  for (const Observation& o : record.observations) {
    out.push_back({0, o.signal, Eigen::VectorXd(static_cast<Eigen::Index>(o.size())), {}});
  }
  all_passes(record, structure, values, moved, variation, out);
  return out;
}

std::vector<Residuals> residuals(std::span<const Record> records, std::size_t index, const ModelStructure& structure,
                                 std::span<const double> values, std::span<const std::vector<std::size_t>> moved) {
  const RotorPhase phase = best_phase(records[index], structure, values);
  std::vector<Residuals> out = residuals_at_phase(records[index], structure, values, moved, phase).residuals;
  for (Residuals& r : out) r.record = index;
  return out;
}

std::vector<Residuals> residuals(std::span<const Record> records, const Model& model, std::span<const double> values,
                                 std::span<const std::vector<std::size_t>> moved) {
  return residuals_at_best_phases(records, model, values, moved).residuals;
}

double sum_of_squares(std::span<const Residuals> residuals) {
  double sum = 0;
  for (const Residuals& r : residuals) sum += r.value.squaredNorm();
  return sum;
}

std::map<Signal, double> mean_squares(std::span<const Residuals> residuals) {
  std::map<Signal, double> squares, counts;
  for (const Residuals& r : residuals) {
    squares[r.signal] += r.value.squaredNorm();
    counts[r.signal] += static_cast<double>(r.value.size());
  }
  for (auto& [signal, square] : squares) square /= counts[signal];
  return squares;
}

double error_of(const std::map<Signal, double>& mean_squares) {
  double sum = 0;
  for (const auto& [signal, square] : mean_squares) sum += square;
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, mean_squares.size())));
}

double shortest_piece(std::span<const Record> records) {
  constexpr double pieces = 128;
  double seconds = 0;
  for (const Record& record : records) seconds += record.excitation.t.back() - record.excitation.t.front();
  return seconds > 0 ? seconds / pieces : 1;
}

}  // namespace emtb
