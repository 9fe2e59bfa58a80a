#include "analysis/diagnose/criterion.h"

#include <algorithm>

namespace emtb {

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

/// The signals of which what is left may ask for more.
std::vector<Signal> MaterialityCriterion::asking_for_more(const Loss& loss) const {
  std::vector<Signal> signals = loss.signals();
  if (torque_only_loads_ && signals.size() > 1) std::erase(signals, Signal::torque);
  return signals;
}

bool MaterialityCriterion::remainder(const Loss& loss) const {
  return std::ranges::any_of(asking_for_more(loss), [&](Signal signal) { return remainder_in(loss, signal); });
}

bool MaterialityCriterion::remainder_in(const Loss& loss, Signal signal) const {
  return emtb::remainder_in(loss, signal, rule_);
}

bool MaterialityCriterion::worth_a_wide_search(const Loss& loss) const {
  return largest_excess(loss, asking_for_more(loss)) >= rule_.remainder;
}

bool MaterialityCriterion::far_off(const Loss& loss) const {
  return remainder(loss) && std::ranges::any_of(asking_for_more(loss),
                                                [&](Signal signal) { return loss.share_left(signal) > rule_.far_off; });
}

bool MaterialityCriterion::worth_trying_all(const Loss& loss) const {
  if (far_off(loss)) return true;
  return std::ranges::any_of(asking_for_more(loss), [&](Signal signal) {
    const double share =
        loss.mean_square(signal) >= rule_.mostly_model ? rule_.remainder_share : rule_.disturbance_share;
    if (remainder_in(loss, signal) && loss.share_left(signal) > share) return true;
    return loss.most_in_a_piece(signal) > rule_.in_a_piece && loss.share_in_a_piece(signal) > rule_.disturbance_share;
  });
}

bool MaterialityCriterion::anything_left(const Loss& loss) const {
  return largest_excess(loss, asking_for_more(loss)) >= rule_.least;
}

}  // namespace emtb
