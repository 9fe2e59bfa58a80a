#include "analysis/live/half_seconds.h"

#include <algorithm>
#include <cmath>

namespace emtb {

double HalfSecond::blocks() const {
  double sum = 0;
  for (const LagSums& s : sums) sum += s.blocks();
  return sum;
}

LiveEquations Timeline::before(std::size_t last) const {
  LiveEquations e = known;
  for (std::size_t k = 0; k + last < half_seconds.size(); ++k) e += half_seconds[k];
  return e;
}

LiveEquations Timeline::recent(std::size_t last) const {
  LiveEquations e = LiveEquations::zero(known.g.size());
  for (std::size_t k = half_seconds.size() - std::min(last, half_seconds.size()); k < half_seconds.size(); ++k) {
    e += half_seconds[k];
  }
  return e;
}

HalfSeconds::HalfSeconds(std::size_t outputs, Eigen::Index unknowns, std::size_t most)
    : older_(outputs, LagSums(unknowns)), ring_(most, HalfSecond{.sums = older_}) {}

void HalfSeconds::clear() {
  for (LagSums& sums : older_) sums.clear();
  for (HalfSecond& half : ring_) {
    for (LagSums& sums : half.sums) sums.clear();
    half.weight = half.omega = half.i_a = 0;
  }
  closed_ = 0;
}

void HalfSeconds::retire_oldest(double kept) {
  HalfSecond& oldest = ring_.front();
  for (std::size_t o = 0; o < older_.size(); ++o) {
    older_[o].fade(kept);
    older_[o].add(oldest.sums[o]);
    oldest.sums[o].clear();
  }
  oldest.weight = oldest.omega = oldest.i_a = 0;
  std::ranges::rotate(ring_, ring_.begin() + 1);
  --closed_;
}

void HalfSeconds::move_point(const Eigen::VectorXd& d) {
  for (LagSums& sums : older_) sums.move_point(d);
  for (HalfSecond& half : ring_) {
    for (LagSums& sums : half.sums) sums.move_point(d);
  }
}

void ScoreScatter::add(const LiveEquations& half_second, const Eigen::VectorXd& at, double kept) {
  squares_ *= kept;
  information_ *= kept;
  squares_ += (half_second.g - half_second.h * at).cwiseAbs2();
  information_ += half_second.h.diagonal();
}

Eigen::VectorXd ScoreScatter::inflation() const {
  Eigen::VectorXd by(squares_.size());
  for (Eigen::Index i = 0; i < by.size(); ++i) {
    by[i] = information_[i] > 0 ? std::sqrt(std::max(1.0, squares_[i] / information_[i])) : 1;
  }
  return by;
}

}  // namespace emtb
