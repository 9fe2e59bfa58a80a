#include "analysis/fit/cost_of_lateness.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "analysis/numerics/linear_algebra.h"

namespace emtb {

CostOfLateness::CostOfLateness(std::vector<OfSignal> signals, Eigen::MatrixXd normal, Eigen::VectorXd other)
    : signals_(std::move(signals)), normal_(std::move(normal)), other_(std::move(other)) {}

double CostOfLateness::at(const std::vector<double>& late) const {
  double squares = 0;
  Eigen::VectorXd gradient = other_;
  for (std::size_t c = 0; c < signals_.size(); ++c) {
    const OfSignal& of = signals_[c];
    const auto place = std::min(static_cast<std::size_t>(late[c] * places), places - 1);
    const double share = late[c] * places - static_cast<double>(place), rest = 1 - share;
    squares +=
        rest * rest * of.squares[place] + 2 * rest * share * of.products[place] + share * share * of.squares[place + 1];
    gradient += rest * of.gradients[place] + share * of.gradients[place + 1];
  }
  const double taken = normal_.rows() > 0 ? gradient.dot(solve_normal(normal_, gradient).col(0)) : 0;
  return 0.5 * (squares - taken);
}

std::vector<double> CostOfLateness::least(const std::vector<char>& held) const {
  constexpr int rounds = 20;
  constexpr double still = 1e-3;  // of a sample
  std::vector<double> late(signals_.size(), 0);
  for (int round = 0; round < rounds; ++round) {
    double moved = 0;
    for (std::size_t c = 0; c < late.size(); ++c) {
      if (held[c] != 0) continue;
      const double before = late[c];
      late[c] = least_of(late, c);
      moved = std::max(moved, std::abs(late[c] - before));
    }
    if (moved < still) break;
  }
  return late;
}

/// Of one signal, between its places a parabola each.
double CostOfLateness::least_of(std::vector<double> late, std::size_t c) const {
  constexpr double width = 1.0 / places;
  const auto cost_at = [&](double place) {
    late[c] = place;
    return at(late);
  };
  double best = 0, least = cost_at(0), before = least;
  const auto look_at = [&](double place, double cost) {
    if (!(cost < least)) return;
    least = cost;
    best = place;
  };
  for (std::size_t i = 0; i < places; ++i) {
    const double from = static_cast<double>(i) * width;
    const double middle = cost_at(from + 0.5 * width), after = cost_at(from + width);
    const double bend = before - 2 * middle + after;
    look_at(from + width, after);
    if (bend > 0) {
      const double vertex = from + width * std::clamp(0.5 + 0.25 * (before - after) / bend, 0.0, 1.0);
      look_at(vertex, cost_at(vertex));
    }
    before = after;
  }
  return best;
}

}  // namespace emtb
