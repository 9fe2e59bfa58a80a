#include "analysis/numerics/lag_sums.h"

#include <algorithm>
#include <cmath>

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

void LagSums::weigh_into(Eigen::MatrixXd& h, Eigen::VectorXd& g, const NoiseColour& c) const {
  const double weight = 1 / (c.sigma * c.sigma * (1 - c.rho * c.rho));
  h += weight * (of_all_.ss + c.rho * c.rho * of_first_.ss - 2 * c.rho * of_pairs_.ss);
  g += weight * (of_all_.sr + c.rho * c.rho * of_first_.sr - 2 * c.rho * of_pairs_.sr);
}

double LagSums::cost(const Eigen::VectorXd& step, const NoiseColour& c) const {
  const double whitened = std::max(0.0, of_all_.after(step)) + c.rho * c.rho * std::max(0.0, of_first_.after(step)) -
                          2 * c.rho * of_pairs_.after(step);
  return whitened / (c.sigma * c.sigma * (1 - c.rho * c.rho));
}

}  // namespace emtb
