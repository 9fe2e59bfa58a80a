#include "estimate/residuals.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <type_traits>

#include "estimate/linear_algebra.h"
#include "estimate/parallel.h"
#include "model/catalogue.h"

namespace emtb {
namespace {

/// The columns of a sensitivity that one pass fills: `count` from `first` on, of `all`.
struct Columns {
  std::size_t first = 0, count = 0;
  Eigen::Index all = 0;
};

/// The instrument behind an observation: what it would have read of the simulated signal, formed as that comes.
template <class Scalar>
class Instrument {
 public:
  explicit Instrument(const Observation& o) : o_(o), averages_(o.first != o.last) {
    if (averages_) integral_at_first_.resize(o.size());
  }

  const Observation& observation() const { return o_; }

  /// @param take called with the number of each reading that ends at grid point k, and its prediction
  template <class Take>
  void see(std::size_t k, const Scalar& x, const Take& take) {
    if (averages_ && !o_.increment) {
      if (k > 0) integral_ += 0.5 * (before_ + x);
      before_ = x;
      for (; begun_ < o_.size() && o_.first[begun_] == k; ++begun_) integral_at_first_[begun_] = integral_;
    }
    if (o_.increment) {
      for (; begun_ < o_.size() && o_.first[begun_] == k; ++begun_) integral_at_first_[begun_] = x;
      for (; done_ < o_.size() && o_.last[done_] == k; ++done_) take(done_, x - integral_at_first_[done_]);
      return;
    }
    for (; done_ < o_.size() && o_.last[done_] == k; ++done_) {
      const std::size_t over = k - o_.first[done_];
      if (over == 0) {
        take(done_, x);
      } else {
        take(done_, (integral_ - integral_at_first_[done_]) * (1.0 / static_cast<double>(over)));
      }
    }
  }

 private:
  const Observation& o_;
  bool averages_;
  std::size_t begun_ = 0, done_ = 0;  ///< readings whose first and whose last grid point has passed
  Scalar integral_{}, before_{};
  std::vector<Scalar> integral_at_first_;  ///< or of an increment, the signal itself
};

/// Compares a record with its simulation: residuals from values, columns of the sensitivities from derivatives.
template <class Scalar>
class Comparison final : public Reader<Scalar> {
 public:
  Comparison(const PreparedRun& record, Columns columns, std::vector<Residuals>& out) : columns_(columns), out_(out) {
    for (const Observation& o : record.observations) instruments_.emplace_back(o);
  }

  void read(std::size_t k, const SimulatedReadings<Scalar>& y) override {
    for (std::size_t s = 0; s < instruments_.size(); ++s) {
      const Observation& o = instruments_[s].observation();
      instruments_[s].see(k, y.of(o.signal), [&](std::size_t reading, const Scalar& predicted) {
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
void pass(const PreparedRun& record, const ModelStructure& structure, std::span<const double> values,
          std::span<const std::vector<std::size_t>> moved, Columns columns, std::vector<Residuals>& out) {
  std::vector<Scalar> p(values.begin(), values.end());
  for (std::size_t j = 0; j < columns.count; ++j) {
    for (const std::size_t place : moved[columns.first + j]) p[place].d[j] = 1;
  }
  Comparison<Scalar> comparison(record, columns, out);
  simulate<Scalar>(structure, p, record.excitation, comparison);
}

/// Room for the residuals of each observation.
std::vector<Residuals> room_for(const PreparedRun& record) {
  std::vector<Residuals> out;
  for (const Observation& o : record.observations) {
    out.push_back({0, o.signal, Eigen::VectorXd(static_cast<Eigen::Index>(o.size())), {}});
  }
  return out;
}

/// As many passes as the columns need.
void all_passes(const PreparedRun& record, const ModelStructure& structure, std::span<const double> values,
                std::span<const std::vector<std::size_t>> moved, std::vector<Residuals>& out) {
  if (moved.empty()) {
    Comparison<double> comparison(record, {}, out);
    simulate<double>(structure, values, record.excitation, comparison);
  }
  const auto all = static_cast<Eigen::Index>(moved.size());
  for (std::size_t first = 0; first < moved.size();) {
    const std::size_t left = moved.size() - first;
    if (left > derivatives_per_pass) {
      const Columns columns{first, std::min(left, 2 * derivatives_per_pass), all};
      pass<WideSensitive>(record, structure, values, moved, columns, out);
      first += columns.count;
    } else {
      pass<Sensitive>(record, structure, values, moved, {first, left, all}, out);
      first += left;
    }
  }
}

/// An effect of a structure that repeats with the angle.
struct PeriodicPart {
  std::size_t index = 0;  ///< among the structure's effects
  std::size_t place = 0;  ///< of its amplitude among the values; its phase comes last of its parameters
  std::size_t count = 0;  ///< of its parameters
  double order = 1;       ///< how often a turn it repeats
};

std::vector<PeriodicPart> periodic_parts(const ModelStructure& structure, std::span<const double> values) {
  std::vector<PeriodicPart> parts;
  std::size_t place = ModelStructure::base_count;
  for (std::size_t k = 0; k < structure.effects.size(); ++k) {
    const EffectInfo& info = effect_catalogue()[structure.effects[k]];
    if (info.periodic) {
      PeriodicPart part{k, place, info.parameter_count, 1};
      for (std::size_t i = 0; i < info.parameter_count; ++i) {
        if (info.parameter_list[i].symbol == "N") part.order = values[place + i];
      }
      parts.push_back(part);
    }
    place += info.parameter_count;
  }
  return parts;
}

/// What waves of unit amplitude, in phase and a quarter of a period later, would do to a record in which nothing
/// repeats with the angle, to first order: with these, the cost at any turn is a quadratic form of its sines and
/// cosines, and no turn needs a simulation of its own.
class WavesOfTurn {
 public:
  WavesOfTurn(const PreparedRun& record, const ModelStructure& structure, std::span<const double> values,
              std::span<const PeriodicPart> parts)
      : parts_(parts.begin(), parts.end()) {
    ModelStructure doubled = structure;
    std::vector<double> still(values.begin(), values.end());
    std::vector<std::vector<std::size_t>> amplitudes(2 * parts_.size());
    for (std::size_t k = parts_.size(); k-- > 0;) {  // from the back: the places before stay as they are
      const PeriodicPart& part = parts_[k];
      amplitudes_.insert(amplitudes_.begin(), still[part.place]);
      still[part.place] = 0;
      const auto begin = still.begin() + static_cast<std::ptrdiff_t>(part.place);
      std::vector<double> later(begin, begin + static_cast<std::ptrdiff_t>(part.count));
      later.back() += std::numbers::pi / 2;
      still.insert(begin + static_cast<std::ptrdiff_t>(part.count), later.begin(), later.end());
      const auto effect = doubled.effects.begin() + static_cast<std::ptrdiff_t>(part.index);
      doubled.effects.insert(effect, *effect);
      const std::size_t before = part.place + shift(k);
      amplitudes[2 * k] = {before};
      amplitudes[2 * k + 1] = {before + part.count};
    }
    std::vector<Residuals> out = room_for(record);
    all_passes(record, doubled, still, amplitudes, out);
    const auto columns = static_cast<Eigen::Index>(amplitudes.size());
    information_.setZero(columns, columns);
    gradient_.setZero(columns);
    for (const Residuals& r : out) {
      squares_ += r.value.squaredNorm();
      if (!r.informed()) continue;
      information_ += gram(r.sensitivity);
      gradient_ += transposed_product(r.sensitivity, r.value);
    }
  }

  double cost(double turn) const {
    Eigen::VectorXd size(gradient_.size());
    for (std::size_t k = 0; k < parts_.size(); ++k) {
      const auto column = static_cast<Eigen::Index>(2 * k);
      size[column] = amplitudes_[k] * std::cos(parts_[k].order * turn);
      size[column + 1] = amplitudes_[k] * std::sin(parts_[k].order * turn);
    }
    return squares_ - 2 * size.dot(gradient_) + size.dot(information_ * size);
  }

 private:
  /// How many values the parts before the k-th have been doubled by.
  std::size_t shift(std::size_t k) const {
    std::size_t sum = 0;
    for (std::size_t i = 0; i < k; ++i) sum += parts_[i].count;
    return sum;
  }

  std::vector<PeriodicPart> parts_;
  std::vector<double> amplitudes_;
  double squares_ = 0;
  Eigen::MatrixXd information_;
  Eigen::VectorXd gradient_;
};

/// Takes out of the other columns what the last one, the turn at the start, does instead, and drops it: the residuals
/// are those at its best value, whatever the parameters are (variable projection after Kaufman, 1975).
void project_off_last(std::vector<Residuals>& out) {
  double own = 0;
  Eigen::RowVectorXd shared;
  for (const Residuals& r : out) {
    if (!r.informed()) continue;
    const auto turn = r.sensitivity.rightCols<1>();
    own += turn.squaredNorm();
    const Eigen::RowVectorXd product = turn.transpose() * r.sensitivity;
    shared = shared.size() > 0 ? Eigen::RowVectorXd(shared + product) : product;
  }
  for (Residuals& r : out) {
    if (!r.informed()) continue;
    if (own > 0) r.sensitivity -= Eigen::VectorXd(r.sensitivity.rightCols<1>()) * (shared / own);
    r.sensitivity.conservativeResize(Eigen::NoChange, r.sensitivity.cols() - 1);
  }
}

}  // namespace

double best_turn(const PreparedRun& record, const ModelStructure& structure, std::span<const double> parameters,
                 std::optional<double> near) {
  const std::vector<PeriodicPart> parts = periodic_parts(structure, parameters);
  if (parts.empty()) return 0;
  const auto [slowest, fastest] = std::ranges::minmax(parts, {}, &PeriodicPart::order);
  const double period = 2 * std::numbers::pi / slowest.order;
  const int steps = 8 * static_cast<int>(std::lround(std::max(1.0, fastest.order / slowest.order)));
  std::vector<double> values(parameters.begin(), parameters.end());
  values.push_back(0);
  std::vector<Residuals> out = room_for(record);
  double best = near.value_or(0);
  if (!near) {
    // There is a valley for each period of the fastest; what is linear tells the lowest of them, near enough.
    constexpr std::size_t looked_at = 3;
    const WavesOfTurn waves(record, structure, parameters, parts);
    std::vector<double> costs;
    for (int k = 0; k < steps; ++k) costs.push_back(waves.cost(period * k / steps));
    std::vector<std::size_t> valleys;
    for (std::size_t k = 0; k < costs.size(); ++k) {
      const double before = costs[(k + costs.size() - 1) % costs.size()], after = costs[(k + 1) % costs.size()];
      if (costs[k] <= before && costs[k] < after) valleys.push_back(k);
    }
    std::ranges::sort(valleys, {}, [&](std::size_t k) { return costs[k]; });
    if (valleys.size() > looked_at) valleys.resize(looked_at);
    double least = std::numeric_limits<double>::infinity();
    for (const std::size_t valley : valleys) {
      values.back() = period * static_cast<double>(valley) / steps;
      all_passes(record, structure, values, {}, out);
      if (const double cost = sum_of_squares(out); cost < least) {
        least = cost;
        best = values.back();
      }
    }
  }
  const std::vector<std::vector<std::size_t>> turn{{values.size() - 1}};
  for (int k = 0; k < (near ? 1 : 2); ++k) {
    values.back() = best;
    out = room_for(record);
    all_passes(record, structure, values, turn, out);
    double gradient = 0, curvature = 0;
    for (const Residuals& r : out) {
      if (!r.informed()) continue;
      gradient += r.sensitivity.col(0).dot(r.value);
      curvature += r.sensitivity.col(0).squaredNorm();
    }
    if (curvature <= 0) break;
    best += std::clamp(gradient / curvature, -period / steps, period / steps);
  }
  return best;
}

std::vector<Residuals> residuals_at_turn(const PreparedRun& record, const ModelStructure& structure,
                                         std::span<const double> values,
                                         std::span<const std::vector<std::size_t>> moved, double turn) {
  std::vector<Residuals> out = room_for(record);
  if (periodic_parts(structure, values).empty()) {
    all_passes(record, structure, values, moved, out);
    return out;
  }
  std::vector<double> turned(values.begin(), values.end());
  turned.push_back(turn);
  std::vector<std::vector<std::size_t>> with_turn(moved.begin(), moved.end());
  if (!moved.empty()) with_turn.push_back({values.size()});
  all_passes(record, structure, turned, with_turn, out);
  if (!moved.empty()) project_off_last(out);
  return out;
}

std::vector<Residuals> residuals(std::span<const PreparedRun> records, std::size_t index,
                                 const ModelStructure& structure, std::span<const double> values,
                                 std::span<const std::vector<std::size_t>> moved) {
  const double turn = best_turn(records[index], structure, values);
  std::vector<Residuals> out = residuals_at_turn(records[index], structure, values, moved, turn);
  for (Residuals& r : out) r.record = index;
  return out;
}

std::vector<Residuals> residuals(std::span<const PreparedRun> records, const Model& model,
                                 std::span<const double> values, std::span<const std::vector<std::size_t>> moved) {
  std::vector<std::vector<Residuals>> each(records.size());
  parallel_for(
      records.size(),
      [&](std::size_t i) { each[i] = residuals(records, i, records[i].structure(model), values, moved); },
      [&](std::size_t i) { return records[i].length(); });
  std::vector<Residuals> all;
  for (auto& one : each) std::ranges::move(one, std::back_inserter(all));
  return all;
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
