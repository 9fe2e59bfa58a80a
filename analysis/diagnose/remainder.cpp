#include "analysis/diagnose/remainder.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

namespace emtb {
namespace {

/// What passes by itself tells no law.
bool passes(Condition c) { return c == Condition::time || c == Condition::heat; }

/// The mean of a map at a place, linear between its bins; none beyond them.
std::optional<double> mean_at(const ResidualMap& map, double place) {
  if (map.bins.empty() || place < map.bins.front() || place > map.bins.back()) return std::nullopt;
  const auto above = std::ranges::upper_bound(map.bins, place);
  if (above == map.bins.end()) return map.mean.back();
  const auto k = static_cast<std::size_t>(above - map.bins.begin());
  if (k == 0) return map.mean.front();
  const double share = (place - map.bins[k - 1]) / (map.bins[k] - map.bins[k - 1]);
  return map.mean[k - 1] + share * (map.mean[k] - map.mean[k - 1]);
}

/// The share of its mean square that another map takes away from a map.
double taken(const ResidualMap& from, const ResidualMap& by) {
  double squares = 0, gone = 0;
  for (std::size_t b = 0; b < from.bins.size(); ++b) {
    squares += from.count[b] * from.rmse[b] * from.rmse[b];
    const std::optional<double> mean = mean_at(by, from.bins[b]);
    if (mean) gone += from.count[b] * (from.mean[b] * from.mean[b] - std::pow(from.mean[b] - *mean, 2));
  }
  return squares > 0 ? gone / squares : 0;
}

}  // namespace

double reproduced(std::span<const ResidualMap> seen, std::span<const ResidualMap> again, Signal signal) {
  double most = 0;
  for (const ResidualMap& map : again) {
    if (map.signal != signal || passes(map.against)) continue;
    const auto same = std::ranges::find_if(
        seen, [&](const ResidualMap& m) { return m.signal == map.signal && m.against == map.against; });
    if (same != seen.end()) most = std::max(most, taken(map, *same));
  }
  return most;
}

bool worth_a_name(const Dataset& data, const Model& model, const Loss& held_out, const Materiality& rule) {
  constexpr double clear = 0.15;  // of what is left beyond the floor: twelve bins of noise take less
  std::vector<Signal> small;
  for (const Signal signal : held_out.signals()) {
    if (!remainder_in(held_out, signal, rule) || held_out.floor_is_upper_bound(signal)) continue;
    if (held_out.share_left(signal) > rule.remainder_share) return true;
    small.push_back(signal);
  }
  const std::size_t half = data.train.size() / 2;
  const std::span<const Record> train = data.train;
  const auto seen = data.held_out.empty() ? train.first(half) : train;
  const auto again = data.held_out.empty() ? train.subspan(half) : std::span<const Record>(data.held_out);
  if (small.empty() || seen.empty()) return false;
  const std::vector<ResidualMap> first = residual_maps(seen, model), second = residual_maps(again, model);
  return std::ranges::any_of(small, [&](Signal signal) {
    const double mean = held_out.mean_square(signal);
    return reproduced(first, second, signal) > clear * (mean - 1) / mean;
  });
}

}  // namespace emtb
