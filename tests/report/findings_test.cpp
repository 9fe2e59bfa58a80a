#include "report/findings.h"

#include <gtest/gtest.h>

namespace emtb {
namespace {

TEST(Findings, SayWhetherTheRecordingsContradictThemselvesOrTheModelsBounds) {
  DataFinding own, bounds, remark;
  own.stops = bounds.stops = true;
  bounds.by_bounds = remark.by_bounds = true;
  EXPECT_EQ(why_nothing_is_fitted({remark, own}),
            "these recordings contradict themselves. Mend them, or add --unchecked");
  const std::string mend = "Mend them, or widen the bounds in the model's file, or add --unchecked";
  EXPECT_EQ(why_nothing_is_fitted({bounds}), "these recordings contradict the model's bounds. " + mend);
  EXPECT_EQ(why_nothing_is_fitted({own, bounds}),
            "these recordings contradict themselves and the model's bounds. " + mend);
}

}  // namespace
}  // namespace emtb
