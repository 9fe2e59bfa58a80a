#include "analysis/diagnose/explained_floor.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace emtb {
namespace {

/// Was it read off the signal's own scatter? What was declared, or follows from steps, is no guess.
bool is_a_scatter(const NoiseFloor& floor) {
  return floor.from == FloorSource::settled || floor.from == FloorSource::repeats ||
         floor.from == FloorSource::regression || floor.from == FloorSource::differences;
}

/// Does a score promise half of what is left of some signal?
bool promises_half(const Score& score, const Loss& left) {
  constexpr double half = 0.5;
  return std::ranges::any_of(left.mean_squares(),
                             [&](const auto& of) { return score.predicted_gain > half * of.second; });
}

}  // namespace

std::optional<Noise> floors_without_a_law(FittedTrials& trials, const Noise& noise, const Trial& fitted) {
  constexpr double all_but = 0.25;  // of a mean square
  std::vector<Score> worth = trials.scores_about(fitted);
  std::erase_if(worth, [&](const Score& s) { return !promises_half(s, fitted.held_out); });
  std::optional<Noise> quieter;
  if (worth.empty()) return quieter;
  for (const Addition& with : trials.refits(fitted, worth, Breadth::promising).done) {
    if (!trials.determined(with.trial.model(), with.effect())) continue;
    for (const auto& [signal, before] : fitted.held_out.mean_squares()) {
      const double after = with.trial.held_out.mean_square(signal);
      if (!is_a_scatter(noise.at(signal)) || after > all_but * before) continue;
      if (!quieter) quieter = noise;
      double& sigma = quieter->at(signal).sigma;
      sigma = std::min(sigma, noise.at(signal).sigma * std::sqrt(after));
    }
  }
  return quieter;
}

}  // namespace emtb
