#include "analysis/live/summed_pass.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace emtb {
namespace {

constexpr double recent_memory = 5;  ///< [s] over which excitation is told; by hand

}  // namespace

SummedPass::SummedPass(const LivePlan& plan)
    : plan_(plan),
      kept_(std::exp(-static_cast<double>(plan.block) * plan.period / recent_memory)),
      sums_(2, std::vector(plan.seconds,
                           Second(plan.outputs.size(), LagSums(static_cast<Eigen::Index>(plan.unknowns()))))),
      pass_(plan, *this) {
  const auto n = static_cast<Eigen::Index>(plan.unknowns());
  recent_.assign(plan.outputs.size(), Eigen::MatrixXd::Zero(n, n));
}

void SummedPass::begin(std::span<const double> values) {
  for (auto& chapter : sums_) {
    for (Second& second : chapter) {
      for (LagSums& sums : second) sums.clear();
    }
  }
  for (auto& recent : recent_) recent.setZero();
  pass_.begin(values);
}

void SummedPass::forget_chapter() {
  if (pass_.in_first_chapter()) return begin(std::vector<double>(pass_.values()));
  std::swap(sums_[0], sums_[1]);
  for (Second& second : sums_[1]) {
    for (LagSums& sums : second) sums.clear();
  }
  pass_.forget_chapter();
}

void SummedPass::end_block() {
  for (auto& recent : recent_) recent *= kept_;
}

void SummedPass::take(const LiveRow& row) {
  recent_[row.output].noalias() += row.s * row.s.transpose();
  LagSums& sums = sums_[row.chapter][std::min(row.tick / plan_.second, plan_.seconds - 1)][row.output];
  sums.add(row.s, row.r);
  if (row.follows) sums.add_pair(row.s_before, row.r_before, row.s, row.r);
}

std::vector<LagSums> SummedPass::totals(std::size_t chapters) const {
  std::vector<LagSums> totals(plan_.outputs.size(), LagSums(static_cast<Eigen::Index>(plan_.unknowns())));
  for (std::size_t chapter = 0; chapter < chapters; ++chapter) {
    for (const Second& second : sums_[chapter]) {
      for (std::size_t o = 0; o < totals.size(); ++o) {
        if (second[o].blocks() > 0) totals[o].add(second[o]);
      }
    }
  }
  return totals;
}

}  // namespace emtb
