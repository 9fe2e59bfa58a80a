#include "analysis/live/relinearised_fit.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "analysis/numerics/bounded_step.h"
#include "analysis/numerics/linear_algebra.h"

namespace emtb {
namespace {

constexpr double relinearise_at = 0.2;  ///< standard errors from the point about which the sums are linear; by hand

constexpr double fewest_blocks = 20;  ///< of which a mean square tells something; by hand

}  // namespace

RelinearisedFit::RelinearisedFit(const Model& model, const FreeParameters& free, const LivePlan& plan)
    : free_(free),
      plan_(plan),
      knowledge_(model, free, plan),
      solution_(knowledge_),
      colours_(plan.outputs.size()),
      first_(std::make_unique<SummedPass>(plan)),
      second_(std::make_unique<SummedPass>(plan)) {
  first_->begin(free.spread(free.pick({})));
}

/// The point about which the equations of a pass are linear; they are linear in offsets anyway.
Eigen::VectorXd RelinearisedFit::point_of(const LivePass& pass) const {
  const std::vector<double> values = free_.pick(pass.values());
  Eigen::VectorXd at = Eigen::VectorXd::Zero(as_index(plan_.unknowns()));
  std::ranges::copy(values, at.data());
  return at;
}

void RelinearisedFit::advance(const std::vector<LiveChapter>& history, std::size_t end, int ticks) {
  for (int k = 0; k < ticks && first_->advance(history, end); ++k) {
  }
}

bool RelinearisedFit::advance_second(const std::vector<LiveChapter>& history, std::size_t end, int ticks) {
  if (!second_follows_) return false;
  for (int k = 0; k < ticks && second_->advance(history, end); ++k) {
  }
  if (!second_->at_same_place(*first_)) return false;
  second_follows_ = false;
  if (!second_is_better()) {
    damping_ = std::max(1e-2, 10 * damping_);
    return false;
  }
  damping_ = damping_ < 1e-3 ? 0 : damping_ / 10;
  std::swap(first_, second_);
  solution_.restart();
  return true;
}

bool RelinearisedFit::solve(std::vector<NoiseColour> colours) {
  colours_ = std::move(colours);
  if (!solution_.solve(*first_, colours_, point_of(pass()))) return false;
  first_->expect(solution_.step());
  return true;
}

void RelinearisedFit::find_errors() { solution_.find_errors(*first_, colours_); }

void RelinearisedFit::relinearise() {
  const Eigen::Index p = as_index(free_.size());
  if (second_follows_ || solution_.distance(p) < relinearise_at) return;
  const Eigen::VectorXd at = point_of(pass());
  const Eigen::VectorXd to = at + damped_step(at);
  if (!to.allFinite()) return;
  second_->begin(free_.spread(std::vector<double>(to.data(), to.data() + p)));
  second_follows_ = true;
}

/// No further than the linear equations can be trusted: a factor of three, a third of the bounds from zero.
Eigen::VectorXd RelinearisedFit::damped_step(const Eigen::VectorXd& at) const {
  const Eigen::VectorXd &low = knowledge_.low(), &high = knowledge_.high();
  Eigen::VectorXd least = low - at, most = high - at;
  for (Eigen::Index i = 0; i < as_index(free_.size()); ++i) {
    const double reach = std::max(2.0 / 3 * std::abs(at[i]), low[i] > 0 ? 0.0 : (high[i] - low[i]) / 3);
    least[i] = std::max(least[i], -reach);
    most[i] = std::min(most[i], low[i] > 0 ? 3 * reach : reach);
  }
  Eigen::MatrixXd h = solution_.equations().h;
  h.diagonal() *= 1 + damping_;
  return bounded_step(h, solution_.equations().g, least, most);
}

double RelinearisedFit::cost(const SummedPass& pass, const Eigen::VectorXd& offsets) const {
  double sum = 0;
  const std::vector<LagSums> sums = pass.totals(2);
  for (std::size_t o = 0; o < sums.size(); ++o) sum += sums[o].cost(offsets, colours_[o]);
  return knowledge_.cost(sum, point_of(pass.pass()) + offsets);
}

bool RelinearisedFit::second_is_better() {
  Eigen::VectorXd offsets = solution_.step();
  offsets.head(as_index(free_.size())).setZero();
  const double now = cost(*first_, offsets), then = cost(*second_, offsets);
  return then < now + 1e-3;  // not where it is not finite
}

void RelinearisedFit::absorb_chapter(bool empty) {
  second_follows_ = false;
  if (free_.size() == 0 || empty) return;
  LiveEquations told = LiveEquations::zero(as_index(plan_.unknowns()));
  told.add(first_->totals(1), colours_);
  told.h /= solution_.inflation();
  told.g /= solution_.inflation();
  knowledge_.absorb(told, point_of(pass()));
}

std::vector<double> RelinearisedFit::left() const {
  std::vector<double> all(plan_.outputs.size(), 0.0);
  const std::vector<LagSums> sums = first_->totals(2);
  for (std::size_t o = 0; o < all.size(); ++o) {
    if (sums[o].blocks() < fewest_blocks || !(colours_[o].sigma > 0)) continue;
    all[o] = std::sqrt(std::max(0.0, sums[o].cost(solution_.step(), colours_[o]) / sums[o].blocks()));
  }
  return all;
}

Eigen::VectorXd RelinearisedFit::variance_after_more() const {
  Eigen::MatrixXd more = solution_.equations().h;
  for (std::size_t o = 0; o < plan_.outputs.size(); ++o) {
    const NoiseColour& c = colours_[o];
    more += (1 - c.rho) / ((1 + c.rho) * c.sigma * c.sigma) * first_->recent(o);
  }
  return scaled_inverse(more).diagonal();
}

}  // namespace emtb
