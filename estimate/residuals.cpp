#include "estimate/residuals.h"

#include <cmath>

#include "estimate/parallel.h"

namespace emtb {
namespace {

template <class Scalar>
const std::vector<Scalar>& signal_of(const Trajectory<Scalar>& y, Signal signal) {
  switch (signal) {
    case Signal::e_a:
      return y.e_a;
    case Signal::i_a:
      return y.i_a;
    case Signal::torque:
      return y.torque;
    case Signal::theta:
      return y.theta;
    default:
      return y.omega;
  }
}

/// Fills up to four columns of each sensitivity from one pass with derivatives.
void fill_columns(const PreparedRun& record, const Trajectory<Sensitive>& y, Eigen::Index column, Eigen::Index count,
                  Eigen::Index columns, std::vector<Residuals>& out) {
  for (std::size_t s = 0; s < record.observations.size(); ++s) {
    const Observation& o = record.observations[s];
    const std::vector<Sensitive>& signal = signal_of(y, o.signal);
    Residuals& r = out[s];
    for (Eigen::Index c = 0; c < count; ++c) {
      const auto derivative = [&](std::size_t k) { return signal[k].d[static_cast<std::size_t>(c)]; };
      bool moves = false;
      for (std::size_t k = 0; k < signal.size() && !moves; ++k) moves = derivative(k) != 0;
      if (!moves) continue;
      if (!r.informed()) r.sensitivity.setZero(r.value.size(), columns);
      for (std::size_t i = 0; i < o.size(); ++i) {
        r.sensitivity(static_cast<Eigen::Index>(i), column + c) = o.predicted(i, derivative) / o.sigma[i];
      }
    }
  }
}

}  // namespace

std::vector<Residuals> residuals(std::span<const PreparedRun> records, std::size_t index,
                                 const ModelStructure& structure, std::span<const double> values,
                                 std::span<const std::vector<std::size_t>> moved) {
  const PreparedRun& record = records[index];
  std::vector<Residuals> out;
  const auto compare = [&](const auto& trajectory) {
    for (const Observation& o : record.observations) {
      const auto& signal = signal_of(trajectory, o.signal);
      Residuals r{index, o.signal, Eigen::VectorXd(static_cast<Eigen::Index>(o.size())), {}};
      for (std::size_t i = 0; i < o.size(); ++i) {
        const double predicted = o.predicted(i, [&](std::size_t k) { return value_of(signal[k]); });
        r.value[static_cast<Eigen::Index>(i)] = (o.value[i] - predicted) / o.sigma[i];
      }
      out.push_back(std::move(r));
    }
  };
  if (moved.empty()) {
    Trajectory<double> y;
    simulate<double>(structure, values, record.excitation, y);
    compare(y);
    return out;
  }
  Trajectory<Sensitive> y;
  for (std::size_t c = 0; c < moved.size(); c += derivatives_per_pass) {
    const std::size_t count = std::min(derivatives_per_pass, moved.size() - c);
    std::vector<Sensitive> p(values.begin(), values.end());
    for (std::size_t j = 0; j < count; ++j) {
      for (const std::size_t place : moved[c + j]) p[place].d[j] = 1;
    }
    simulate<Sensitive>(structure, p, record.excitation, y);
    if (c == 0) compare(y);
    fill_columns(record, y, static_cast<Eigen::Index>(c), static_cast<Eigen::Index>(count),
                 static_cast<Eigen::Index>(moved.size()), out);
  }
  return out;
}

std::vector<Residuals> residuals(std::span<const PreparedRun> records, const Model& model,
                                 std::span<const double> values, std::span<const std::vector<std::size_t>> moved) {
  std::vector<std::vector<Residuals>> each(records.size());
  parallel_for(records.size(),
               [&](std::size_t i) { each[i] = residuals(records, i, records[i].structure(model), values, moved); });
  std::vector<Residuals> all;
  for (auto& one : each) std::ranges::move(one, std::back_inserter(all));
  return all;
}

std::vector<std::vector<std::size_t>> moved_by(const FreeParameters& free) {
  std::vector<std::vector<std::size_t>> moved(free.size());
  for (std::size_t place = 0; place < free.spread(free.pick({})).size(); ++place) {
    if (const auto mover = free.mover(place)) moved[*mover].push_back(place);
  }
  return moved;
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
