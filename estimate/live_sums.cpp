#include "estimate/live_sums.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "estimate/linear_algebra.h"

namespace emtb {

LagSums::LagSums(Eigen::Index parameters)
    : ss_(parameters, parameters), ss_next_(parameters, parameters), sr_(parameters), sr_next_(parameters) {
  clear();
}

void LagSums::clear() {
  ss_.setZero();
  ss_next_.setZero();
  sr_.setZero();
  sr_next_.setZero();
  rr_ = rr_next_ = blocks_ = pairs_ = 0;
}

void LagSums::add(const LagSums& other) {
  ss_ += other.ss_;
  ss_next_ += other.ss_next_;
  sr_ += other.sr_;
  sr_next_ += other.sr_next_;
  rr_ += other.rr_;
  rr_next_ += other.rr_next_;
  blocks_ += other.blocks_;
  pairs_ += other.pairs_;
}

void LagSums::fade(double share) {
  ss_ *= share;
  ss_next_ *= share;
  sr_ *= share;
  sr_next_ *= share;
  rr_ *= share;
  rr_next_ *= share;
  blocks_ *= share;
  pairs_ *= share;
}

void LagSums::move_point(const Eigen::VectorXd& d) {
  rr_ = squares(d);
  rr_next_ = products(d);
  sr_ -= ss_ * d;
  sr_next_ -= ss_next_ * d;
}

// By pointer: Eigen checks every index and size, and this runs with the samples.

void LagSums::add(const Eigen::VectorXd& s, double r) {
  const auto n = static_cast<std::size_t>(s.size());
  double *ss = ss_.data(), *sr = sr_.data();
  const double* a = s.data();
  for (std::size_t j = 0; j < n; ++j) {
    for (std::size_t i = 0; i < n; ++i) *ss++ += a[i] * a[j];
    sr[j] += a[j] * r;
  }
  rr_ += r * r;
  ++blocks_;
}

void LagSums::add_pair(const Eigen::VectorXd& s_before, double r_before, const Eigen::VectorXd& s, double r) {
  const auto n = static_cast<std::size_t>(s.size());
  double *ss = ss_next_.data(), *sr = sr_next_.data();
  const double *a = s.data(), *b = s_before.data();
  for (std::size_t j = 0; j < n; ++j) {
    for (std::size_t i = 0; i < n; ++i) *ss++ += 0.5 * (a[i] * b[j] + b[i] * a[j]);
    sr[j] += 0.5 * (a[j] * r_before + b[j] * r);
  }
  rr_next_ += r * r_before;
  ++pairs_;
}

double LagSums::squares(const Eigen::VectorXd& step) const {
  return std::max(0.0, rr_ - 2 * sr_.dot(step) + step.dot(ss_ * step));
}

double LagSums::products(const Eigen::VectorXd& step) const {
  return rr_next_ - 2 * sr_next_.dot(step) + step.dot(ss_next_ * step);
}

void LagSums::weigh_into(Eigen::MatrixXd& h, Eigen::VectorXd& g, const Colour& c) const {
  const double weight = 1 / (c.sigma * c.sigma * (1 - c.rho * c.rho));
  h += weight * ((1 + c.rho * c.rho) * ss_ - 2 * c.rho * ss_next_);
  g += weight * ((1 + c.rho * c.rho) * sr_ - 2 * c.rho * sr_next_);
}

double LagSums::cost(const Eigen::VectorXd& step, const Colour& c) const {
  const double whitened = (1 + c.rho * c.rho) * squares(step) - 2 * c.rho * products(step);
  return whitened / (c.sigma * c.sigma * (1 - c.rho * c.rho));
}

Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& a) {
  const Eigen::VectorXd size = a.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigensystem eigen = eigensystem(size.asDiagonal() * a * size.asDiagonal());
  const double rounding = 1e-14 * eigen.values.maxCoeff();
  const Eigen::MatrixXd root =
      size.asDiagonal() * eigen.vectors * eigen.values.cwiseMax(rounding).cwiseSqrt().cwiseInverse().asDiagonal();
  return product(root, root.transpose());
}

Eigen::VectorXd bounded_step(const Eigen::MatrixXd& h, const Eigen::VectorXd& g, const Eigen::VectorXd& low,
                             const Eigen::VectorXd& high) {
  const Eigen::Index n = g.size();
  Eigen::VectorXd step = Eigen::VectorXd::Zero(n);
  std::vector<Eigen::Index> inner, held;
  for (Eigen::Index i = 0; i < n; ++i) inner.push_back(i);
  while (!inner.empty()) {
    // What is held at a bound pulls at the others.
    Eigen::VectorXd pull = g(inner);
    if (!held.empty()) pull -= h(inner, held) * step(held);
    const Eigen::MatrixXd covariance = inverse_of(h(inner, inner));
    const Eigen::VectorXd part = covariance * pull;
    std::size_t worst = inner.size();
    double most = 0;
    for (std::size_t k = 0; k < inner.size(); ++k) {
      const auto row = static_cast<Eigen::Index>(k);
      const double beyond = std::max(part[row] - high[inner[k]], low[inner[k]] - part[row]);
      const double in_errors = beyond / std::sqrt(covariance(row, row));
      if (beyond > 0 && in_errors > most) {
        most = in_errors;
        worst = k;
      }
      step[inner[k]] = part[row];
    }
    if (worst == inner.size()) break;
    const Eigen::Index i = inner[worst];
    step[i] = std::clamp(step[i], low[i], high[i]);
    held.push_back(i);
    inner.erase(inner.begin() + static_cast<std::ptrdiff_t>(worst));
  }
  return step.cwiseMax(low).cwiseMin(high);
}

}  // namespace emtb
