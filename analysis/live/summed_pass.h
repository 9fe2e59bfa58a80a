#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "analysis/live/pass.h"
#include "analysis/numerics/lag_sums.h"

namespace emtb {

/// A pass over the history and the sums that it leaves, for each second and each output.
class SummedPass : private LiveRows {
 public:
  /// @param plan is kept
  explicit SummedPass(const LivePlan& plan);

  /// As LivePass.
  void begin(std::span<const double> values);
  bool advance(const std::vector<LiveChapter>& history, std::size_t end) { return pass_.advance(history, end); }
  void forget_chapter();
  bool at_same_place(const SummedPass& other) const { return pass_.at_same_place(other.pass_); }
  void expect(const Eigen::VectorXd& step) { pass_.expect(step); }
  const LivePass& pass() const { return pass_; }

  /// Of each output, over the first so many chapters.
  std::vector<LagSums> totals(std::size_t chapters) const;

  /// One second after another, each with the sums of each output.
  template <class Take>
  void for_each_second(const Take& take) const {
    for (const auto& chapter : sums_) {
      for (const auto& second : chapter) take(second);
    }
  }

  /// Σ s sᵀ of an output over the last seconds, which fade.
  const Eigen::MatrixXd& recent(std::size_t output) const { return recent_[output]; }

 private:
  void take(const LiveRow& row) override;
  void end_block() override;

  using Second = std::vector<LagSums>;  ///< by output

  const LivePlan& plan_;
  const double kept_;                      ///< share of what is recent, a block later
  std::vector<std::vector<Second>> sums_;  ///< by chapter
  std::vector<Eigen::MatrixXd> recent_;    ///< by output
  LivePass pass_;
};

}  // namespace emtb
