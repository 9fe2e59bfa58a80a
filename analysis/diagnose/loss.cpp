#include "analysis/diagnose/loss.h"

#include <algorithm>
#include <cmath>

namespace emtb {

Loss::Loss(const Noise& noise) {
  for (const auto& [signal, floor] : noise) autocorrelation_[signal] = floor.autocorrelation;
}

void Loss::add(std::span<const Record> records, std::span<const Residuals> residuals) {
  for (const Residuals& r : residuals) {
    const Record& record = records[r.record];
    const Observation& o = *record.find(r.signal);
    Readings& readings = signals_[r.signal];
    double second = -1;
    for (Eigen::Index i = 0; i < r.value.size(); ++i) {
      const double t = std::floor(record.excitation.t[o.last[static_cast<std::size_t>(i)]]);
      if (t != second) readings.ends.push_back(readings.residual.size());
      second = t;
      readings.residual.push_back(r.value[i]);
      readings.ends.back() = readings.residual.size();
    }
  }
}

std::map<Signal, double> Loss::mean_squares() const {
  std::map<Signal, double> mean;
  for (const auto& [signal, readings] : signals_) {
    double squares = 0;
    for (const double r : readings.residual) squares += r * r;
    mean[signal] = squares / std::max(1.0, static_cast<double>(readings.residual.size()));
  }
  return mean;
}

double Loss::error() const { return error_of(mean_squares()); }

double Loss::noise_error(Signal signal) const {
  const double n = static_cast<double>(signals_.at(signal).residual.size());
  const double squared = autocorrelation_.at(signal) * autocorrelation_.at(signal);  // that of the squares
  return std::sqrt(2 / std::max(1.0, n) * (1 + squared) / (1 - squared));
}

std::map<Signal, Loss::Difference> Loss::difference(const Loss& worse, const Loss& better) {
  std::map<Signal, Difference> differences;
  for (const auto& [signal, readings] : worse.signals_) {
    const auto other = better.signals_.find(signal);
    if (other == better.signals_.end()) continue;
    const std::vector<double>& r = other->second.residual;
    double gain = 0, variance = 0, added = 0;
    std::size_t k = 0;
    for (const std::size_t end : readings.ends) {
      double random = 0;
      for (; k < end; ++k) {
        const double d = readings.residual[k] - r[k];
        gain += d * d + 2 * r[k] * d;
        random += 2 * r[k] * d;
        added += d * d;
      }
      variance += random * random;
    }
    const double n = std::max(1.0, static_cast<double>(r.size()));
    const double rho = worse.autocorrelation_.at(signal);
    const double noise = 2 * std::sqrt(added * (1 + rho) / (1 - rho));
    differences[signal] = {gain / n, noise / n, std::sqrt(variance) / n};
  }
  return differences;
}

bool takes_share(const Loss& before, double share, const Loss& without, const Loss& with, const Materiality& rule) {
  const auto mean = before.mean_squares();
  return std::ranges::any_of(Loss::difference(without, with), [&](const auto& entry) {
    const auto& [signal, d] = entry;
    const double excess = mean.at(signal) - 1;  // at the floor there is nothing left to remove
    return excess >= rule.least && d.gain >= share * excess && d.gain >= rule.least &&
           d.gain > rule.errors * d.noise_error;
  });
}

bool material(const Loss& without, const Loss& with, const Materiality& rule) {
  return with.error() < without.error() && takes_share(without, rule.share, without, with, rule);
}

bool tied(const Loss& best, const Loss& other, const Materiality& rule) {
  const auto mean = other.mean_squares();
  return std::ranges::all_of(Loss::difference(other, best), [&](const auto& entry) {
    const auto& [signal, d] = entry;
    const double bound = std::max(rule.distinct, rule.share * (mean.at(signal) - 1));
    return d.gain <= 2 * d.block_error || d.gain < bound;
  });
}

double largest_excess(const Loss& loss) {
  double largest = 0;
  for (const auto& [signal, mean_square] : loss.mean_squares()) largest = std::max(largest, mean_square - 1);
  return largest;
}

bool remainder(const Loss& loss, const Materiality& rule) {
  return std::ranges::any_of(loss.mean_squares(), [&](const auto& entry) {
    const auto& [signal, mean] = entry;
    return mean - 1 > rule.remainder && mean - 1 > rule.remainder_errors * loss.noise_error(signal);
  });
}

}  // namespace emtb
