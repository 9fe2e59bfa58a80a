#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

#include "analysis/live/knowledge.h"
#include "analysis/live/solution.h"
#include "analysis/live/summed_pass.h"
#include "model/model.h"

namespace emtb {

/// Least squares by Gauss and Newton over a history that grows: a pass whose sums are solved and, where the solution
/// has left the point about which they are linear, a second one that follows the history from its beginning with the
/// solution's values, and takes the first one's place if its cost is lower (Levenberg and Marquardt's rule).
class RelinearisedFit {
 public:
  /// @param free, plan are kept
  RelinearisedFit(const Model& model, const FreeParameters& free, const LivePlan& plan);

  /// Goes on along the history by so many ticks at most.
  void advance(const std::vector<LiveChapter>& history, std::size_t end, int ticks);

  /// The same of the second pass, where there is one. @return it has caught up, and its values are the better ones
  bool advance_second(const std::vector<LiveChapter>& history, std::size_t end, int ticks);

  /// @param colours of the outputs' noise. @return false: the sums are not finite
  bool solve(std::vector<NoiseColour> colours);

  void find_errors();

  /// Begins a second pass, where the solution is far enough from the point of the first one.
  void relinearise();

  /// The first chapter is about to be forgotten: what it told is kept as knowledge. All ticks have been taken.
  /// @param empty there is nothing in it
  void absorb_chapter(bool empty);

  /// It was forgotten, and the second took its place.
  void forget_chapter() { first_->forget_chapter(); }

  const LivePass& pass() const { return first_->pass(); }
  const LiveKnowledge& knowledge() const { return knowledge_; }
  const LiveSolution& solution() const { return solution_; }
  const std::vector<NoiseColour>& colours() const { return colours_; }

  /// The unknowns as they are solved for.
  Eigen::VectorXd estimate() const { return point_of(pass()) + solution_.step(); }

  /// What the solution leaves of each output over all of the history, in units of the noise floor: 1 where the model is
  /// right; 0 where nothing was compared yet.
  std::vector<double> left() const;

  /// Of each unknown, if the last seconds came once more; beside the covariance of the solution it tells what these
  /// informed.
  Eigen::VectorXd variance_after_more() const;

 private:
  Eigen::VectorXd point_of(const LivePass& pass) const;
  double cost(const SummedPass& pass, const Eigen::VectorXd& offsets) const;
  bool second_is_better();
  Eigen::VectorXd damped_step(const Eigen::VectorXd& at) const;

  const FreeParameters& free_;
  const LivePlan& plan_;
  LiveKnowledge knowledge_;
  LiveSolution solution_;
  std::vector<NoiseColour> colours_;
  std::unique_ptr<SummedPass> first_, second_;
  bool second_follows_ = false;
  double damping_ = 0;
};

}  // namespace emtb
