#include "analysis/fit/phase_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "analysis/numerics/linear_algebra.h"
#include "model/catalogue.h"

namespace emtb {

std::vector<PeriodicPart> periodic_parts(const ModelStructure& structure, std::span<const double> values) {
  std::vector<PeriodicPart> parts;
  std::size_t place = ModelStructure::base_count;
  for (std::size_t k = 0; k < structure.effects.size(); ++k) {
    const EffectInfo& info = effect_catalogue()[structure.effects[k]];
    if (info.periodic) {
      const auto order = info.place_of(Role::order);
      parts.push_back({k, place, info.parameter_count, order ? values[place + *order] : 1});
    }
    place += info.parameter_count;
  }
  return parts;
}

WavesOfPhase::WavesOfPhase(const Record& record, const ModelStructure& structure, std::span<const double> values,
                           std::span<const PeriodicPart> parts, const Knots& knots)
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
  const auto columns = static_cast<Eigen::Index>(amplitudes.size());
  pieces_.resize(std::max<std::size_t>(1, knots.count() - 1),
                 {Eigen::MatrixXd::Zero(columns, columns), Eigen::VectorXd::Zero(columns)});
  for (const Residuals& r : simulated_residuals(record, doubled, still, amplitudes)) {
    if (!r.informed()) continue;
    const std::vector<Knots::Place> places = knots.of(r);
    for (std::size_t begin = 0, end = 0; begin < places.size(); begin = end) {
      while (end < places.size() && places[end].knot == places[begin].knot) ++end;
      const auto from = static_cast<Eigen::Index>(begin), rows = static_cast<Eigen::Index>(end - begin);
      Piece& piece = pieces_[places[begin].knot];
      piece.information += gram(r.sensitivity.middleRows(from, rows));
      piece.gradient += transposed_product(r.sensitivity.middleRows(from, rows), r.value.segment(from, rows));
    }
  }
}

double WavesOfPhase::cost(std::size_t piece, double phase) const {
  const auto& [information, gradient] = pieces_[piece];
  Eigen::VectorXd size(gradient.size());
  for (std::size_t k = 0; k < parts_.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(2 * k);
    size[column] = amplitudes_[k] * std::cos(parts_[k].order * phase);
    size[column + 1] = amplitudes_[k] * std::sin(parts_[k].order * phase);
  }
  return size.dot(information * size) - 2 * size.dot(gradient);
}

std::vector<RotorPhase> likely_phases(const WavesOfPhase& waves, const Knots& knots, double period, int steps,
                                      double stiffer) {
  constexpr std::size_t looked_at = 3;
  const auto n = static_cast<std::size_t>(steps);
  const double width = period / steps;
  const auto wave_costs = [&](std::size_t piece) {
    std::vector<double> costs(n);
    for (std::size_t s = 0; s < n; ++s) costs[s] = waves.cost(piece, width * static_cast<double>(s));
    return costs;
  };
  // As far as the phase may go from knot to knot: five standard deviations, or half of the period.
  const double stiffness = stiffer * knots.stiffness() * width * width;
  const int reach = knots.count() > 1 ? static_cast<int>(std::min(0.5 * steps, 1 + 5 / std::sqrt(stiffness))) : 0;
  std::vector<double> cost = wave_costs(0);
  std::vector<std::vector<int>> moved(1, std::vector<int>(n, 0));  // steps from the knot before
  for (std::size_t piece = 1; piece < waves.pieces(); ++piece) {
    std::vector<double> after = wave_costs(piece);
    std::vector<int>& ways = moved.emplace_back(n, 0);
    for (std::size_t s = 0; s < n; ++s) {
      double least = std::numeric_limits<double>::infinity();
      for (int way = -reach; way <= reach; ++way) {
        const double sum = cost[(s + static_cast<std::size_t>(steps - way)) % n] + stiffness * way * way;
        if (sum < least) least = sum, ways[s] = way;
      }
      after[s] += least;
    }
    cost = std::move(after);
  }
  std::vector<std::size_t> valleys;
  for (std::size_t s = 0; s < n; ++s) {
    if (cost[s] <= cost[(s + n - 1) % n] && cost[s] < cost[(s + 1) % n]) valleys.push_back(s);
  }
  if (valleys.empty()) valleys.push_back(0);
  std::ranges::sort(valleys, {}, [&](std::size_t s) { return cost[s]; });
  if (valleys.size() > looked_at) valleys.resize(looked_at);
  std::vector<RotorPhase> phases;
  for (const std::size_t valley : valleys) {
    RotorPhase phase{std::vector<double>(knots.count(), 0.0), 0};
    auto at = static_cast<int>(valley);
    phase.at.back() = width * at;
    for (std::size_t piece = waves.pieces(); knots.count() > 1 && piece-- > 0;) {
      at -= moved[piece][static_cast<std::size_t>((at % steps + steps) % steps)];
      phase.at[piece] = width * at;
    }
    phases.push_back(std::move(phase));
  }
  return phases;
}

}  // namespace emtb
