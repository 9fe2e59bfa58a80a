#include "analysis/diagnose/loss.h"

#include <algorithm>
#include <cmath>

namespace emtb {
namespace {

constexpr double half_of_it = 0.5;  // of what is too much; by hand

/// [floors] What is further off, or no number, has left all bounds: by how much tells nothing, and squares of it may be
/// no numbers any more, which are neither more nor less than others.
constexpr double all_bounds = 1e15;

bool beyond_all_bounds(const Residuals& r) { return !(r.value.array().abs() <= all_bounds).all(); }

Residuals within_all_bounds(Residuals r) {
  for (double& value : r.value) {
    if (!(std::abs(value) <= all_bounds)) value = std::copysign(all_bounds, std::isnan(value) ? 1 : value);
  }
  return r;
}

}  // namespace

Loss::Loss(const Noise& noise) : floors_(noise) {}

void Loss::add(std::span<const Record> records, std::span<const Residuals> residuals, bool unseen) {
  for (const Residuals& as_left : residuals) {
    const bool leaves = beyond_all_bounds(as_left);
    leaves_all_bounds_ = leaves_all_bounds_ || leaves;
    const Residuals bounded = leaves ? within_all_bounds(as_left) : Residuals{};
    const Residuals& r = leaves ? bounded : as_left;
    const Record& record = records[r.record];
    const Observation& o = *record.find(r.signal);
    if (unseen) add_squares(squares_, record, r);
    Readings& readings = signals_[r.signal];
    const std::vector<double>& grid = record.excitation.t;
    const double length = std::min(1.0, 0.1 * (grid.back() - grid.front()));  // [s]
    double piece = -1;
    for (Eigen::Index i = 0; i < r.value.size(); ++i) {
      const double its = std::floor((grid[o.last[static_cast<std::size_t>(i)]] - grid.front()) / length);
      if (its != piece) readings.ends.push_back(readings.residual.size());
      piece = its;
      readings.residual.push_back(static_cast<float>(r.value[i]));
      readings.squared += r.value[i] * r.value[i];
      const double value = o.value[static_cast<std::size_t>(i)] / floors_.at(r.signal).sigma;
      readings.sum += value;
      readings.squares += value * value;
      readings.ends.back() = readings.residual.size();
    }
  }
}

std::vector<Signal> Loss::signals() const {
  std::vector<Signal> all;
  for (const auto& [signal, readings] : signals_) all.push_back(signal);
  return all;
}

double Loss::mean_square(Signal signal) const {
  const Readings& readings = signals_.at(signal);
  return readings.squared / std::max(1.0, static_cast<double>(readings.residual.size()));
}

std::map<Signal, double> Loss::mean_squares() const {
  std::map<Signal, double> mean;
  for (const auto& [signal, readings] : signals_) mean[signal] = mean_square(signal);
  return mean;
}

double Loss::error() const { return error_of(mean_squares()); }

double Loss::noise_error(Signal signal) const {
  const double n = static_cast<double>(signals_.at(signal).residual.size());
  const NoiseFloor& floor = floors_.at(signal);
  const double squared = floor.autocorrelation * floor.autocorrelation;  // that of the squares
  return std::hypot(std::sqrt(2 / std::max(1.0, n) * (1 + squared) / (1 - squared)), 2 * floor.relative_error);
}

double Loss::Readings::variance() const {
  const double n = std::max(1.0, static_cast<double>(residual.size()));
  return squares / n - sum * sum / (n * n);
}

double Loss::share_left(Signal signal) const {
  const double varies = signals_.at(signal).variance(), excess = mean_square(signal) - 1;
  return excess > 0 && varies > 0 ? std::sqrt(excess / varies) : 0;
}

double Loss::most_in_a_piece(Signal signal) const {
  constexpr double errors = 4;  // one of a hundred pieces is further off by chance at 2.6
  const Readings& readings = signals_.at(signal);
  const double by_noise = std::max(0.0, floors_.at(signal).autocorrelation);
  double most = 0;
  std::size_t begin = 0;
  for (const std::size_t end : readings.ends) {
    double shared = 0;
    for (std::size_t k = begin + 1; k < end; ++k) {
      const double before = readings.residual[k - 1], left = readings.residual[k];
      shared += before * left;
    }
    const double n = static_cast<double>(end - begin);
    most = std::max(most, shared / n - by_noise - errors / std::sqrt(n));
    begin = end;
  }
  return most;
}

double Loss::share_in_a_piece(Signal signal) const {
  const double varies = signals_.at(signal).variance();
  return varies > 0 ? std::sqrt(most_in_a_piece(signal) / varies) : 0;
}

std::map<Signal, Loss::Difference> Loss::difference(const Loss& worse, const Loss& better) {
  std::map<Signal, Difference> differences;
  for (const auto& [signal, readings] : worse.signals_) {
    const auto other = better.signals_.find(signal);
    if (other == better.signals_.end()) continue;
    const SharedColumn<float>& r = other->second.residual;
    double gain = 0, variance = 0, added = 0;
    std::size_t k = 0;
    for (const std::size_t end : readings.ends) {
      double random = 0;
      for (; k < end; ++k) {
        const double left = r[k], with = readings.residual[k], d = with - left;
        gain += d * d + 2 * left * d;
        random += 2 * left * d;
        added += d * d;
      }
      variance += random * random;
    }
    const double n = std::max(1.0, static_cast<double>(r.size()));
    const double rho = worse.floors_.at(signal).autocorrelation;
    const double noise = 2 * std::sqrt(added * (1 + rho) / (1 - rho));
    differences[signal] = {gain / n, noise / n, std::sqrt(variance) / n, added > 0 ? gain / added : 1};
  }
  return differences;
}

bool likelier(const Loss& a, const Loss& b) {
  if (!a.quality || !b.quality) return a.error() < b.error();
  return gain(*b.quality, *a.quality) > gain(*a.quality, *b.quality);
}

bool takes_share(const Loss& before, double share, const Loss& without, const Loss& with, const Materiality& rule) {
  const auto mean = before.mean_squares();
  return std::ranges::any_of(Loss::difference(without, with), [&](const auto& entry) {
    const auto& [signal, d] = entry;
    const double excess = mean.at(signal) - 1;  // at the floor there is nothing left to remove
    return excess >= rule.least && d.gain >= share * excess && d.gain >= rule.least &&
           d.gain > rule.errors * d.noise_error && (d.there >= rule.there || d.gain >= half_of_it * excess);
  });
}

bool takes_all_but(double share, const Loss& without, const Loss& with) {
  const double most = share * largest_excess(without);
  return std::ranges::all_of(
      with.signals(), [&](Signal signal) { return with.mean_square(signal) - 1 + with.noise_error(signal) <= most; });
}

bool worth_a_step(const Loss& without, const Loss& with, const Materiality& rule) {
  return with.error() < without.error() && takes_share(without, rule.share, without, with, rule);
}

bool material(const Loss& without, const Loss& with, const Materiality& rule) {
  if (!with.quality || !without.quality) return worth_a_step(without, with, rule);
  return gain(*without.quality, *with.quality) > rule.nats && takes_share(without, rule.share, without, with, rule);
}

bool beyond_the_laws(const Loss& as_given, const Loss& without, const Loss& with, const Materiality& rule) {
  const auto at_first = as_given.mean_squares(), before = without.mean_squares();
  return std::ranges::any_of(Loss::difference(without, with), [&](const auto& entry) {
    const auto& [signal, d] = entry;
    const auto first = at_first.find(signal);
    const double taken = first != at_first.end() ? std::max(0.0, first->second - before.at(signal)) : 0;
    const double left = with.mean_square(signal) - 1 - with.noise_error(signal);
    const bool to_the_floor = before.at(signal) - 1 > rule.remainder && left <= rule.share * (before.at(signal) - 1);
    return d.gain >= rule.least && (to_the_floor || d.gain > rule.law_share * rule.law_share * taken);
  });
}

bool tied(const Loss& best, const Loss& other, const Materiality& rule) {
  const auto mean = other.mean_squares();
  return std::ranges::all_of(Loss::difference(other, best), [&](const auto& entry) {
    const auto& [signal, d] = entry;
    const double bound = std::max(rule.distinct, rule.share * (mean.at(signal) - 1));
    return d.gain <= 2 * d.block_error || d.gain < bound;
  });
}

double largest_excess(const Loss& loss) { return largest_excess(loss, loss.signals()); }

double largest_excess(const Loss& loss, std::span<const Signal> signals) {
  double largest = 0;
  for (const Signal signal : signals) largest = std::max(largest, loss.mean_square(signal) - 1);
  return largest;
}

bool removes_most(const Loss& without, const Loss& with) {
  return largest_excess(with) <= (1 - half_of_it) * largest_excess(without);
}

bool carries_most(const Loss& without, const Loss& with) {
  if (!without.quality || !with.quality || !removes_most(without, with)) return false;
  return gain(*without.quality, *with.quality) > by_far_likelier;
}

bool remainder_in(const Loss& loss, Signal signal, const Materiality& rule) {
  const double excess = loss.mean_square(signal) - 1;
  return excess > rule.remainder && excess > rule.remainder_errors * loss.noise_error(signal);
}

bool remainder(const Loss& loss, const Materiality& rule) {
  return std::ranges::any_of(loss.signals(), [&](Signal signal) { return remainder_in(loss, signal, rule); });
}

}  // namespace emtb
