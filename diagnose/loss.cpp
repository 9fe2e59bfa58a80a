#include "diagnose/loss.h"

#include <algorithm>
#include <cmath>

namespace emtb {

void Loss::add(std::span<const Record> records, std::span<const Residuals> residuals, std::size_t first_record) {
  for (const Residuals& r : residuals) {
    const Record& record = records[r.record];
    const Observation& o = *std::ranges::find(record.observations, r.signal, &Observation::signal);
    Blocks& blocks = signals_[r.signal];
    for (Eigen::Index i = 0; i < r.value.size(); ++i) {
      const double t = record.excitation.t[o.last[static_cast<std::size_t>(i)]];
      Block& block = blocks[{first_record + r.record, std::lround(std::floor(t))}];
      block.squares += r.value[i] * r.value[i];
      block.count += 1;
    }
  }
}

std::map<Signal, double> Loss::mean_squares() const {
  std::map<Signal, double> mean;
  for (const auto& [signal, blocks] : signals_) {
    double squares = 0, count = 0;
    for (const auto& [key, block] : blocks) squares += block.squares, count += block.count;
    mean[signal] = squares / std::max(1.0, count);
  }
  return mean;
}

double Loss::error() const { return error_of(mean_squares()); }

double Loss::standard_error(Signal signal) const {
  const auto found = signals_.find(signal);
  if (found == signals_.end()) return 0;
  const double mean = mean_squares().at(signal);
  double squares = 0, count = 0;
  for (const auto& [key, block] : found->second) {
    squares += std::pow(block.squares - mean * block.count, 2);
    count += block.count;
  }
  return std::sqrt(squares) / std::max(1.0, count);
}

std::map<Signal, Loss::Difference> Loss::difference(const Loss& worse, const Loss& better) {
  std::map<Signal, Difference> differences;
  for (const auto& [signal, blocks] : worse.signals_) {
    const auto other = better.signals_.find(signal);
    if (other == better.signals_.end()) continue;
    double gain = 0, count = 0;
    const auto squares_of = [&](const auto& key) {
      const auto found = other->second.find(key);
      return found == other->second.end() ? 0.0 : found->second.squares;
    };
    for (const auto& [key, block] : blocks) gain += block.squares - squares_of(key), count += block.count;
    gain /= std::max(1.0, count);
    double spread = 0;
    for (const auto& [key, block] : blocks) {
      spread += std::pow(block.squares - squares_of(key) - gain * block.count, 2);
    }
    differences[signal] = {gain, std::sqrt(spread) / std::max(1.0, count)};
  }
  return differences;
}

namespace {

bool materially_better(const Loss& without, const Loss& with, const Materiality& rule) {
  const auto mean = without.mean_squares();
  return std::ranges::any_of(Loss::difference(without, with), [&](const auto& entry) {
    const auto& [signal, d] = entry;
    const double excess = std::max(0.0, mean.at(signal) - 1);
    return d.gain >= rule.share * excess && d.gain >= rule.least && d.gain > rule.errors * d.standard_error;
  });
}

}  // namespace

bool material(const Loss& without, const Loss& with, const Materiality& rule) {
  return with.error() < without.error() && materially_better(without, with, rule);
}

bool tied(const Loss& best, const Loss& other, const Materiality& rule) {
  const auto mean = other.mean_squares();
  return std::ranges::all_of(Loss::difference(other, best), [&](const auto& entry) {
    const auto& [signal, d] = entry;
    const double bound = std::max(rule.least, rule.share * (mean.at(signal) - 1));
    return d.gain <= 2 * d.standard_error || d.gain < bound;
  });
}

bool remainder(const Loss& loss, const Materiality& rule) {
  return std::ranges::any_of(loss.mean_squares(), [&](const auto& entry) {
    const auto& [signal, mean] = entry;
    return mean - 1 > rule.remainder && mean - 1 > rule.errors * loss.standard_error(signal);
  });
}

}  // namespace emtb
