#include "hal/did_you_mean.h"

#include <gtest/gtest.h>

namespace emtb {
namespace {

const std::vector<std::string> words{"diagnose", "report", "replay", "dry_brake", "dry_friction", "warm_friction"};

TEST(DidYouMean, NamesTheWordThatIsATypingErrorAway) {
  EXPECT_EQ(did_you_mean("diagnos", words), "; did you mean diagnose?");
  EXPECT_EQ(did_you_mean("reprot", words), "; did you mean report?");
}

TEST(DidYouMean, NamesTheWordsThatHoldWhatWasTyped) {
  EXPECT_EQ(did_you_mean("brake", words), "; did you mean dry_brake?");
  EXPECT_EQ(did_you_mean("friction", words), "; did you mean dry_friction or warm_friction?");
  EXPECT_EQ(did_you_mean("warm", words), "; did you mean warm_friction?");
}

TEST(DidYouMean, SaysNothingWhereNoWordIsNear) {
  EXPECT_EQ(did_you_mean("frobnicate", words), "");
  EXPECT_EQ(did_you_mean("fr", words), "") << "two letters tell nothing";
  EXPECT_EQ(did_you_mean("", words), "");
  EXPECT_EQ(did_you_mean("6", {"5", "7.3"}), "") << "nothing of it would stay";
  EXPECT_EQ(did_you_mean("diagnose", {}), "");
  EXPECT_EQ(did_you_mean(std::string(100000, 'd'), words), "");
  EXPECT_EQ(did_you_mean("word", {"word_a", "word_b", "word_c", "word_d"}), "") << "too many to choose from";
}

}  // namespace
}  // namespace emtb
