#include "analysis/live/sums.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "analysis/numerics/linear_algebra.h"

namespace emtb {

void LagSums::Products::clear() {
  ss.setZero();
  sr.setZero();
  rr = 0;
}

void LagSums::Products::add(const Products& other) {
  ss += other.ss;
  sr += other.sr;
  rr += other.rr;
}

// By pointer: Eigen checks every index and size, and this runs with the samples.
void LagSums::Products::add(const Eigen::VectorXd& s, double r) {
  const auto n = static_cast<std::size_t>(s.size());
  double *to = ss.data(), *with_r = sr.data();
  const double* a = s.data();
  for (std::size_t j = 0; j < n; ++j) {
    for (std::size_t i = 0; i < n; ++i) *to++ += a[i] * a[j];
    with_r[j] += a[j] * r;
  }
  rr += r * r;
}

void LagSums::Products::fade(double share) {
  ss *= share;
  sr *= share;
  rr *= share;
}

void LagSums::Products::move_point(const Eigen::VectorXd& d) {
  rr = after(d);
  sr -= ss * d;
}

double LagSums::Products::after(const Eigen::VectorXd& step) const {
  return rr - 2 * sr.dot(step) + step.dot(ss * step);
}

LagSums::LagSums(Eigen::Index parameters)
    : of_all_(parameters), of_first_(parameters), of_pairs_(parameters), s_(parameters) {
  clear();
}

void LagSums::clear() {
  for (Products* p : {&of_all_, &of_first_, &of_pairs_}) p->clear();
  s_.setZero();
  r_ = blocks_ = pairs_ = 0;
}

void LagSums::add(const LagSums& other) {
  of_all_.add(other.of_all_);
  of_first_.add(other.of_first_);
  of_pairs_.add(other.of_pairs_);
  s_ += other.s_;
  r_ += other.r_;
  blocks_ += other.blocks_;
  pairs_ += other.pairs_;
}

void LagSums::fade(double share) {
  for (Products* p : {&of_all_, &of_first_, &of_pairs_}) p->fade(share);
  s_ *= share;
  r_ *= share;
  blocks_ *= share;
  pairs_ *= share;
}

void LagSums::move_point(const Eigen::VectorXd& d) {
  for (Products* p : {&of_all_, &of_first_, &of_pairs_}) p->move_point(d);
  r_ -= s_.dot(d);
}

void LagSums::level() {
  if (blocks_ == 0) return;
  const Eigen::VectorXd mean = s_ / blocks_;
  const double r = r_ / blocks_;
  const auto put = [&](Products& products, double count) {
    products.ss = count * mean * mean.transpose();
    products.sr = count * r * mean;
  };
  put(of_all_, blocks_);
  put(of_first_, pairs_);
  put(of_pairs_, pairs_);
}

void LagSums::add(const Eigen::VectorXd& s, double r) {
  of_all_.add(s, r);
  s_ += s;
  r_ += r;
  ++blocks_;
}

void LagSums::add_pair(const Eigen::VectorXd& s_before, double r_before, const Eigen::VectorXd& s, double r) {
  of_first_.add(s_before, r_before);
  const auto n = static_cast<std::size_t>(s.size());
  double *ss = of_pairs_.ss.data(), *sr = of_pairs_.sr.data();
  const double *a = s.data(), *b = s_before.data();
  for (std::size_t j = 0; j < n; ++j) {
    for (std::size_t i = 0; i < n; ++i) *ss++ += 0.5 * (a[i] * b[j] + b[i] * a[j]);
    sr[j] += 0.5 * (a[j] * r_before + b[j] * r);
  }
  of_pairs_.rr += r * r_before;
  ++pairs_;
}

void LagSums::weigh_into(Eigen::MatrixXd& h, Eigen::VectorXd& g, const Colour& c) const {
  const double weight = 1 / (c.sigma * c.sigma * (1 - c.rho * c.rho));
  h += weight * (of_all_.ss + c.rho * c.rho * of_first_.ss - 2 * c.rho * of_pairs_.ss);
  g += weight * (of_all_.sr + c.rho * c.rho * of_first_.sr - 2 * c.rho * of_pairs_.sr);
}

double LagSums::cost(const Eigen::VectorXd& step, const Colour& c) const {
  const double whitened = std::max(0.0, of_all_.after(step)) + c.rho * c.rho * std::max(0.0, of_first_.after(step)) -
                          2 * c.rho * of_pairs_.after(step);
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
