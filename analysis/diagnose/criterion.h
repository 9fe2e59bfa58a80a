#pragma once

#include <vector>

#include "analysis/diagnose/loss.h"

namespace emtb {

/// What decides between models. A search asks this and nothing else about losses, so that another criterion can take
/// its place.
class Criterion {
 public:
  virtual ~Criterion() = default;

  /// Does going from `without` to `with` remove something that counts, and make the whole no worse?
  virtual bool material(const Loss& without, const Loss& with) const = 0;

  /// The same, to go on from there: what it gains may show only beside what comes after it, when less is left to hide
  /// it.
  virtual bool worth_a_step(const Loss& without, const Loss& with) const { return material(without, with); }

  /// Is what it removes more than a law that removed all the rest may be off by?
  virtual bool beyond_the_laws(const Loss& as_given, const Loss& without, const Loss& with) const = 0;

  /// Does it still count beside an effect that shapes the same edges, as a share of what was there before both, or
  /// since both leave nothing?
  virtual bool material_beside_same_edges(const Loss& before, const Loss& without, const Loss& with) const = 0;

  /// Is `other` as good as `best`?
  virtual bool tied(const Loss& best, const Loss& other) const = 0;

  /// Is something left that should have a name?
  virtual bool remainder(const Loss& loss) const = 0;

  /// The same of one signal.
  virtual bool remainder_in(const Loss& loss, Signal signal) const = 0;

  /// Is some signal so far above its floor that two effects at once, or all whole orders, are worth their time?
  virtual bool worth_a_wide_search(const Loss& loss) const = 0;

  /// Is a model so far off that scores, which are linear, say little of what it lacks?
  virtual bool far_off(const Loss& loss) const = 0;

  /// Is what is left of some signal so much that the scores may have passed by what it lacks? Where the answer would be
  /// that nothing explains it, at least.
  virtual bool worth_trying_all(const Loss& loss) const = 0;

  /// Is some signal so far above its floor that anything material could be removed?
  virtual bool anything_left(const Loss& loss) const = 0;
};

/// Judges by materiality. Where a measured torque only loads the shaft, as it was read, what a law of the load leaves
/// of that reading bends nothing else, and asks for no more than was found: it counts in what is better or worse, and
/// where nothing else is compared.
class MaterialityCriterion final : public Criterion {
 public:
  explicit MaterialityCriterion(const Materiality& rule, bool torque_only_loads = false)
      : rule_(rule), torque_only_loads_(torque_only_loads) {}

  bool material(const Loss& without, const Loss& with) const override;
  bool worth_a_step(const Loss& without, const Loss& with) const override;
  bool beyond_the_laws(const Loss& as_given, const Loss& without, const Loss& with) const override;
  bool material_beside_same_edges(const Loss& before, const Loss& without, const Loss& with) const override;
  bool tied(const Loss& best, const Loss& other) const override;
  bool remainder(const Loss& loss) const override;
  bool remainder_in(const Loss& loss, Signal signal) const override;
  bool worth_a_wide_search(const Loss& loss) const override;
  bool far_off(const Loss& loss) const override;
  bool worth_trying_all(const Loss& loss) const override;
  bool anything_left(const Loss& loss) const override;

 private:
  std::vector<Signal> asking_for_more(const Loss& loss) const;

  Materiality rule_;
  bool torque_only_loads_;
};

}  // namespace emtb
