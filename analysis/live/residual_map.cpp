#include "analysis/live/residual_map.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace emtb {
namespace {

constexpr double memory = 300;        ///< rows in one bin; by hand
constexpr double fewest = 5;          ///< rows that tell an RMS; by hand
constexpr double first_reach = 1e-3;  ///< SI, from which the range doubles

}  // namespace

LiveResidualMap::LiveResidualMap(Signal against, std::size_t outputs) : against_(against) {
  for (auto& cell : cells_) cell.resize(outputs);
}

/// Two bins become one, on either side of zero.
void LiveResidualMap::widen() {
  reach_ *= 2;
  auto merged = cells_;
  constexpr std::size_t half = count / 2;
  for (auto& cell : merged) std::ranges::fill(cell, Cell{});
  for (std::size_t b = 0; b < count; ++b) {
    const std::size_t to = half + b / 2 - half / 2;
    for (std::size_t o = 0; o < cells_[b].size(); ++o) {
      merged[to][o].squares += cells_[b][o].squares;
      merged[to][o].weight += cells_[b][o].weight;
    }
  }
  cells_ = std::move(merged);
}

void LiveResidualMap::add(double x, std::size_t output, double normalised) {
  if (!std::isfinite(x) || !std::isfinite(normalised)) return;
  if (reach_ == 0) reach_ = first_reach;
  while (std::abs(x) > reach_) widen();
  const double place = (x / reach_ + 1) * count / 2;
  Cell& cell = cells_[std::min(count - 1, static_cast<std::size_t>(std::max(0.0, place)))][output];
  const double kept = 1 - 1 / memory;
  cell.squares = kept * cell.squares + normalised * normalised;
  cell.weight = kept * cell.weight + 1;
}

std::vector<LiveBin> LiveResidualMap::bins(const LivePlan& plan) const {
  std::vector<LiveBin> all;
  for (std::size_t b = 0; b < count; ++b) {
    LiveBin bin{.against = against_, .normalised = {}};
    bin.from = reach_ * (2.0 * static_cast<double>(b) / count - 1);
    bin.to = bin.from + 2 * reach_ / count;
    for (std::size_t o = 0; o < plan.outputs.size(); ++o) {
      const Cell& cell = cells_[b][o];
      if (cell.weight >= fewest) bin.normalised[plan.outputs[o].signal] = std::sqrt(cell.squares / cell.weight);
    }
    if (!bin.normalised.empty()) all.push_back(std::move(bin));
  }
  return all;
}

}  // namespace emtb
