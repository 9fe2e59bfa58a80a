#include "hal/shared_column.h"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

namespace emtb {
namespace {

TEST(SharedColumn, IsHeldOnceByAllWhoCopyIt) {
  const SharedColumn<double> one{1, 2, 3};
  const SharedColumn<double> other = one;
  EXPECT_EQ(other.data(), one.data());
}

TEST(SharedColumn, ChangesForNobodyElse) {
  const SharedColumn<double> kept{1, 2, 3};
  SharedColumn<double> edited = kept, longer = kept, shorter = kept, cleared = kept;
  edited.edit()[1] = 7;
  longer.push_back(4);
  shorter.erase(shorter.begin());
  cleared.clear();
  EXPECT_EQ(kept, (SharedColumn<double>{1, 2, 3}));
  EXPECT_EQ(edited, (SharedColumn<double>{1, 7, 3}));
  EXPECT_EQ(longer, (SharedColumn<double>{1, 2, 3, 4}));
  EXPECT_EQ(shorter, (SharedColumn<double>{2, 3}));
  EXPECT_TRUE(cleared.empty());
}

TEST(SharedColumn, IsNotCopiedToBeChangedByTheOnlyOneWhoHoldsIt) {
  SharedColumn<double> alone{1, 2, 3};
  const double* const at = alone.data();
  alone.edit()[0] = 5;
  EXPECT_EQ(alone.data(), at);
  EXPECT_EQ(alone.front(), 5);
}

TEST(SharedColumn, SharesWhatIsTheSame) {
  const SharedColumn<double> times{1, 2, 3};
  SharedColumn<double> same{1, 2, 3}, other{1, 2, 4};
  EXPECT_TRUE(same.share(times));
  EXPECT_FALSE(other.share(times));
  EXPECT_EQ(same.data(), times.data());
  EXPECT_EQ(other.back(), 4);
}

TEST(SharedColumn, LeavesNothingWhereItWasMovedFrom) {
  SharedColumn<double> from{1, 2};
  const SharedColumn<double> to = std::move(from);
  from = {};
  EXPECT_TRUE(from.empty());
  EXPECT_EQ(to.size(), 2);
}

}  // namespace
}  // namespace emtb
