#include "analysis/diagnose/remainder.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <utility>
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

namespace {

/// The maps of what is left of the runs that were fitted, and of others: held out, or where none are, of the other half
/// of the runs, or of each run.
std::pair<std::vector<ResidualMap>, std::vector<ResidualMap>> maps_of_two_parts(const Dataset& data,
                                                                                const Model& model) {
  const std::span<const Record> train = data.train;
  if (!data.held_out.empty()) return {residual_maps(train, model), residual_maps(data.held_out, model)};
  if (train.size() == 1) return {residual_maps(train, model, {0, 0.5}), residual_maps(train, model, {0.5, 1})};
  const std::size_t half = train.size() / 2;
  return {residual_maps(train.first(half), model), residual_maps(train.subspan(half), model)};
}

}  // namespace

bool worth_a_name(const Dataset& data, const Model& model, const Loss& held_out, const Materiality& rule,
                  std::span<const Signal> inputs) {
  constexpr double coloured = 8;  // by so much differences underrate noise that keeps 0.97 from reading to reading
  constexpr double clear = 0.15;  // of what is left beyond the floor: twelve bins of noise take less
  std::vector<Signal> small;
  for (const Signal signal : held_out.signals()) {
    if (std::ranges::find(inputs, signal) != inputs.end()) continue;
    if (!remainder_in(held_out, signal, rule) || held_out.floor_is_upper_bound(signal)) continue;
    // Where the noise is only known to be no less than the floor, it may be all that is left.
    const bool may_be_noise =
        held_out.floor_is_lower_bound(signal) && held_out.mean_square(signal) < coloured * coloured;
    if (held_out.share_left(signal) > rule.remainder_share && !may_be_noise) return true;
    small.push_back(signal);
  }
  if (small.empty()) return false;
  const auto [first, second] = maps_of_two_parts(data, model);
  return std::ranges::any_of(small, [&](Signal signal) {
    const double mean = held_out.mean_square(signal);
    return reproduced(first, second, signal) > clear * (mean - 1) / mean;
  });
}

}  // namespace emtb
