#include "analysis/record/angle_noise.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "analysis/numerics/scatter.h"
#include "analysis/numerics/statistics.h"
#include "analysis/record/time_scatter.h"

namespace emtb {
namespace {

/// Scatter in steps of the pieces in which the shaft rests.
void collect_rest(const Series& theta, std::vector<double>& scatters) {
  constexpr std::size_t length = 32;
  constexpr double widest = 8;  // scatters, as 32 readings tell them, from the lowest to the highest: hardly ever more
  for (std::size_t from = 0; from + length <= theta.value.size(); from += length) {
    const std::span piece = std::span(theta.value).subspan(from, length);
    if (std::ranges::adjacent_find(piece, std::not_equal_to{}) == piece.end()) continue;
    const auto [lowest, highest] = std::ranges::minmax(piece);
    const double scatter = std::min(scatter_of_differences(piece, 3), scatter_of_differences(piece, 5));
    if (highest - lowest <= widest * scatter + theta.lsb) scatters.push_back(scatter / theta.lsb);
  }
}

}  // namespace

double scatter_at_rest(std::span<const Run> runs, std::span<const Run> others) {
  constexpr std::size_t fewest = 3;  // pieces
  constexpr double of_an_encoder =
      0.5;  // steps: one that rests on the edge of a count, or is held there by a controller
  std::vector<double> scatters;
  double step = 0;  // [rad]
  for (const std::span<const Run> some : {runs, others}) {
    for (const Run& run : some) {
      if (!run.has(Signal::theta) || run.at(Signal::theta).lsb <= 0) continue;
      step = run.at(Signal::theta).lsb;
      collect_rest(run.at(Signal::theta), scatters);
    }
  }
  if (scatters.size() < fewest) return 0;
  const double scatter = median(std::move(scatters));
  return scatter > of_an_encoder ? step * std::sqrt(scatter * scatter - 1.0 / 12) : 0;
}

AngleNoise angle_noise(const Model& model, std::span<const Run> runs, std::span<const Run> others) {
  const auto declared = model.noise.find(Signal::theta);
  return {.still = declared != model.noise.end() ? declared->second : scatter_at_rest(runs, others),
          .times = time_scatter(runs, others)};
}

}  // namespace emtb
