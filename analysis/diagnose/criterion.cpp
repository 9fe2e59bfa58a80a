#include "analysis/diagnose/criterion.h"

#include <algorithm>

namespace emtb {
namespace {

/// What is left of the motion; of the torque, where that is all there is.
Loss of_the_motion(const Loss& loss) {
  Loss motion = loss.without(Signal::torque);
  return motion.signals().empty() ? loss : motion;
}

}  // namespace

bool MaterialityCriterion::material(const Loss& without, const Loss& with) const {
  return emtb::material(without, with, rule_);
}

bool MaterialityCriterion::worth_a_step(const Loss& without, const Loss& with) const {
  return emtb::worth_a_step(without, with, rule_);
}

bool MaterialityCriterion::beyond_the_laws(const Loss& as_given, const Loss& without, const Loss& with) const {
  return emtb::beyond_the_laws(as_given, without, with, rule_);
}

bool MaterialityCriterion::material_beside_same_edges(const Loss& before, const Loss& without, const Loss& with) const {
  return takes_share(before, rule_.edge_share, without, with, rule_) || takes_all_but(rule_.edge_left, without, with);
}

bool MaterialityCriterion::tied(const Loss& best, const Loss& other) const { return emtb::tied(best, other, rule_); }

bool MaterialityCriterion::remainder(const Loss& loss) const { return emtb::remainder(loss, rule_); }

bool MaterialityCriterion::remainder_in(const Loss& loss, Signal signal) const {
  return emtb::remainder_in(loss, signal, rule_);
}

bool MaterialityCriterion::worth_a_wide_search(const Loss& loss) const {
  return largest_excess(loss) >= rule_.remainder;
}

bool MaterialityCriterion::far_off(const Loss& loss) const {
  return remainder(loss) &&
         std::ranges::any_of(loss.signals(), [&](Signal signal) { return loss.share_left(signal) > rule_.far_off; });
}

bool MaterialityCriterion::worth_trying_all(const Loss& loss) const {
  if (far_off(loss)) return true;
  return std::ranges::any_of(loss.signals(), [&](Signal signal) {
    return remainder_in(loss, signal) && loss.mean_square(signal) >= rule_.mostly_model &&
           loss.share_left(signal) > rule_.remainder_share;
  });
}

bool MaterialityCriterion::anything_left(const Loss& loss) const { return largest_excess(loss) >= rule_.least; }

bool CriterionOfTheMotion::material(const Loss& without, const Loss& with) const {
  return criterion_.material(without, with);
}

bool CriterionOfTheMotion::worth_a_step(const Loss& without, const Loss& with) const {
  return criterion_.worth_a_step(without, with);
}

bool CriterionOfTheMotion::beyond_the_laws(const Loss& as_given, const Loss& without, const Loss& with) const {
  return criterion_.beyond_the_laws(as_given, without, with);
}

bool CriterionOfTheMotion::material_beside_same_edges(const Loss& before, const Loss& without, const Loss& with) const {
  return criterion_.material_beside_same_edges(before, without, with);
}

bool CriterionOfTheMotion::tied(const Loss& best, const Loss& other) const { return criterion_.tied(best, other); }

bool CriterionOfTheMotion::remainder(const Loss& loss) const { return criterion_.remainder(of_the_motion(loss)); }

bool CriterionOfTheMotion::remainder_in(const Loss& loss, Signal signal) const {
  return criterion_.remainder_in(loss, signal);
}

bool CriterionOfTheMotion::worth_a_wide_search(const Loss& loss) const {
  return criterion_.worth_a_wide_search(of_the_motion(loss));
}

bool CriterionOfTheMotion::far_off(const Loss& loss) const { return criterion_.far_off(of_the_motion(loss)); }

bool CriterionOfTheMotion::worth_trying_all(const Loss& loss) const {
  return criterion_.worth_trying_all(of_the_motion(loss));
}

bool CriterionOfTheMotion::anything_left(const Loss& loss) const {
  return criterion_.anything_left(of_the_motion(loss));
}

}  // namespace emtb
