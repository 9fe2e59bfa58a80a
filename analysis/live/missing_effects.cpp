#include "analysis/live/missing_effects.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "analysis/live/change_test.h"

namespace emtb {
namespace {

constexpr double material_share = 0.1;  ///< of what is left, that an effect has to explain: as in a diagnosis
constexpr double own_share = 1e-6;      ///< of its information, below which the model's own parameters take its place

/// Of the squares that are left, what noise does not explain.
double excess(const HalfSeconds& rows, std::span<const NoiseColour> colours, const Eigen::VectorXd& expected) {
  double squares = 0, blocks = 0;
  for (std::size_t o = 0; o < rows.older().size(); ++o) {
    LagSums sum = rows.older()[o];
    for (const HalfSecond& half : rows.last(rows.closed())) sum.add(half.sums[o]);
    squares += sum.cost(expected, colours[o]);
    blocks += sum.blocks();
  }
  return squares - blocks;
}

}  // namespace

std::vector<LiveSuspect> missing_effects(const WatchedUnknowns& unknowns, const HalfSeconds& rows,
                                         std::span<const NoiseColour> colours, const LiveEquations& all,
                                         const Eigen::VectorXd& expected, const Eigen::MatrixXd& covariance,
                                         const Eigen::VectorXd& inflation, const RestReadings& at_rest) {
  const double left_over = excess(rows, colours, expected);
  const std::vector<Eigen::Index>& of_model = unknowns.of_model();
  std::vector<LiveSuspect> found;
  for (std::size_t j = 0; j < unknowns.parameters().size(); ++j) {
    const WatchedParameter& p = unknowns.parameters()[j];
    const auto i = static_cast<Eigen::Index>(j);
    if (p.in_model() || j == unknowns.gauge()) continue;  // what a gauge shows is known
    const Eigen::VectorXd with = all.h(of_model, i);
    const double information = all.h(i, i) - with.dot(covariance * with);
    const double left = all.g[i] - with.dot(expected(of_model));
    if (!(information > own_share * all.h(i, i))) continue;
    const double value = left / information, drop = left * left / information;
    if (value < p.low || value > p.high || drop < material_share * left_over) continue;
    const double std_error = inflation[i] / std::sqrt(information);
    const double score = std::abs(value) / std_error;
    if (const auto output = unknowns.output_of_reading(j);
        output && at_rest.contradict(*output, value, std_error, colours[*output], change_at::alarm)) {
      continue;
    }
    if (score >= change_at::alarm) found.push_back({p.name, p.unit, value, std_error, score});
  }
  std::ranges::sort(found, std::greater{}, &LiveSuspect::score);
  if (found.size() > most_tied) found.resize(most_tied);
  return found;
}

}  // namespace emtb
