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

/// Hands the residuals and sensitivities of a pass over, some readings at a time.
template <class Scalar>
class Handing final : public Reader<Scalar> {
 public:
  Handing(const Record& record, const ModelStructure& structure, Eigen::Index columns, const VisitReadings& visit)
      : visit_(visit) {
    for (const Observation& o : record.observations) {
      held_.push_back(
          {Instrument<Scalar>(o, structure), 0, 0, Eigen::VectorXd(at_once), Eigen::MatrixXd(at_once, columns)});
    }
  }

  void read(std::size_t k, const SimulatedReadings<Scalar>& y) override {
    for (std::size_t s = 0; s < held_.size(); ++s) {
      Held& held = held_[s];
      const Observation& o = held.instrument.observation();
      held.instrument.see(k, y, [&](std::size_t reading, const Scalar& predicted) {
        const double weight = 1 / o.sigma[reading];
        held.value.data()[held.count] = (o.value[reading] - value_of(predicted)) * weight;
        if constexpr (!std::is_same_v<Scalar, double>) {
          double* entry = held.sensitivity.data() + held.count;
          for (Eigen::Index c = 0; c < held.sensitivity.cols(); ++c, entry += at_once)
            *entry = predicted.d[static_cast<std::size_t>(c)] * weight;
        }
        if (++held.count == at_once) hand_over(s);
      });
    }
  }

  /// What is still held when the simulation has ended.
  void hand_over_the_rest() {
    for (std::size_t s = 0; s < held_.size(); ++s) hand_over(s);
  }

 private:
  static constexpr Eigen::Index at_once = 2048;  // readings: few enough for a cache, many enough for products

  struct Held {
    Instrument<Scalar> instrument;
    Eigen::Index first, count;
    Eigen::VectorXd value;
    Eigen::MatrixXd sensitivity;
  };

  void hand_over(std::size_t s) {
    Held& held = held_[s];
    if (held.count == at_once) {
      visit_(s, held.first, held.value, held.sensitivity);
    } else if (held.count > 0) {
      visit_(s, held.first, held.value.head(held.count), held.sensitivity.topRows(held.count));
    }
    held.first += held.count;
    held.count = 0;
  }

  const VisitReadings& visit_;
  std::vector<Held> held_;
};

/// The values with the derivatives of some columns.
/// @param values of all parameters, and the angle to turn the rotor by at the start
template <class Scalar>
std::vector<Scalar> with_derivatives(std::span<const double> values, std::span<const std::vector<std::size_t>> moved) {
  std::vector<Scalar> p(values.begin(), values.end());
  for (std::size_t j = 0; j < moved.size(); ++j) {
    for (const std::size_t place : moved[j]) p[place].d[j] = 1;
  }
  return p;
}

/// One pass with as many derivatives as the scalar carries.
template <class Scalar>
void pass(const Record& record, const ModelStructure& structure, std::span<const double> values,
          std::span<const std::vector<std::size_t>> moved, const Variation& variation, Columns columns,
          std::vector<Residuals>& out) {
  const std::vector<Scalar> p = with_derivatives<Scalar>(values, moved.subspan(columns.first, columns.count));
  record.count_simulation(structure, columns.count);
  Comparison<Scalar> comparison(record, structure, columns, out);
  simulate<Scalar>(structure, p, record.excitation, comparison, variation);
}

template <class Scalar>
void handing_pass(const Record& record, const ModelStructure& structure, std::span<const Scalar> values,
                  std::size_t columns, const VisitReadings& visit) {
  record.count_simulation(structure, columns);
  Handing<Scalar> handing(record, structure, static_cast<Eigen::Index>(columns), visit);
  simulate<Scalar>(structure, values, record.excitation, handing, {});
  handing.hand_over_the_rest();
}

/// As many passes as the columns need.
void all_passes(const Record& record, const ModelStructure& structure, std::span<const double> values,
                std::span<const std::vector<std::size_t>> moved, const Variation& variation,
                std::vector<Residuals>& out) {
  if (moved.empty()) {
    record.count_simulation(structure, 0);
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

void visit_simulated_residuals(const Record& record, const ModelStructure& structure, std::span<const double> values,
                               std::span<const std::vector<std::size_t>> moved, const VisitReadings& visit) {
  if (moved.empty()) {
    handing_pass<double>(record, structure, values, 0, visit);
  } else if (moved.size() <= derivatives_per_pass) {
    handing_pass<Sensitive>(record, structure, with_derivatives<Sensitive>(values, moved), moved.size(), visit);
  } else if (moved.size() <= 2 * derivatives_per_pass) {
    handing_pass<WideSensitive>(record, structure, with_derivatives<WideSensitive>(values, moved), moved.size(), visit);
  } else {  // a formula of many waves
    std::vector<Residuals> all = simulated_residuals(record, structure, values, moved);
    for (std::size_t s = 0; s < all.size(); ++s) {
      if (!all[s].informed()) all[s].sensitivity.setZero(all[s].value.size(), static_cast<Eigen::Index>(moved.size()));
      visit(s, 0, all[s].value, all[s].sensitivity);
    }
  }
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

}  // namespace emtb
