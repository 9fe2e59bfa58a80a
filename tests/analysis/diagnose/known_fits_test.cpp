#include "analysis/diagnose/known_fits.h"

#include <gtest/gtest.h>

#include "analysis/record/dataset.h"
#include "model/catalogue.h"
#include "tests/blind/recording.h"

namespace emtb {
namespace {

class KnownFit : public testing::Test {
 protected:
  KnownFit() {
    bench_.plant.friction.T_c = 0.003;  // [N m]
    Model with_friction = bench_.model;
    with_friction.include(effect_index("coulomb_friction"));
    data_ = prepare(blind::record(bench_, bench_.train, 1), {}, with_friction);
    best_ = calibrate(data_.train, with_friction, {.extra_starts = 0});
    worse_ = best_;
    worse_.model.base[base::J].value *= 1.3;
    worse_.cost *= 20;
  }

  blind::Bench bench_ = blind::fast_bench();
  Dataset data_;
  Fit best_, worse_;
  KnownFits known_;
};

TEST_F(KnownFit, TakesTheirPlaceThatLeaveMore) {
  EXPECT_FALSE(known_.that_leaves_less(data_.train, worse_)) << "nothing is known";
  known_.remember(best_.model);
  const std::optional<Model> start = known_.that_leaves_less(data_.train, worse_);
  ASSERT_TRUE(start);
  EXPECT_EQ(start->values(), best_.model.values());
  EXPECT_FALSE(known_.that_leaves_less(data_.train, best_)) << "it is that one";
}

TEST_F(KnownFit, IsOfTheSameEffects) {
  known_.remember(best_.model);
  worse_.model.exclude(effect_index("coulomb_friction"));
  EXPECT_FALSE(known_.that_leaves_less(data_.train, worse_));
}

TEST_F(KnownFit, LeavesWhatSomebodyFixed) {
  known_.remember(best_.model);
  worse_.model.base[base::J].fixed = true;
  EXPECT_FALSE(known_.that_leaves_less(data_.train, worse_));
  worse_.model.base[base::J].pinned = true;
  EXPECT_TRUE(known_.that_leaves_less(data_.train, worse_)) << "a pin is the diagnosis's own";
}

}  // namespace
}  // namespace emtb
