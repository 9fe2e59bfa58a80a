#include "analysis/check/sampling.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "session/session.h"

namespace emtb {
namespace {

MATCHER(StopsForItsStamps, "") { return arg.what == Flaw::jitter && arg.signal == Signal::theta && arg.stops; }

/// A shaft that turns evenly, read five times in each 50 ms.
/// @param apart [s] between the stamps of these five @param read_apart [s] between their readings
emtb::Run by_fives(double apart, double read_apart) {
  emtb::Run run;
  run.name = "by fives";
  for (int k = 0; k < 100; ++k) {
    const double begins = 0.05 * (k / 5);
    run.signals[Signal::theta].t.push_back(begins + apart * (k % 5));
    run.signals[Signal::theta].value.push_back(0.001 * std::round(2000 * (begins + read_apart * (k % 5))));
  }
  run.signals[Signal::theta].lsb = 0.001;
  return run;
}

TEST(Sampling, StopsWhereRowsAreStampedSeveralAtATime) {
  EXPECT_THAT(sampling_flaws(by_fives(2e-4, 0.01)), testing::Contains(StopsForItsStamps()));
}

TEST(Sampling, DoesNotStopWhereRowsAreReadSeveralAtATime) {
  EXPECT_THAT(sampling_flaws(by_fives(2e-4, 2e-4)), testing::Not(testing::Contains(StopsForItsStamps())));
  EXPECT_THAT(sampling_flaws(by_fives(0.01, 0.01)), testing::IsEmpty());
}

/// A hundred rows at times of which a logger writes so many digits.
emtb::Run written_at(double apart, double jitter, double digit) {
  emtb::Run run;
  for (int k = 0; k < 100; ++k) {
    const double t = apart * k + (k % 3 == 0 ? jitter : 0);
    run.signals[Signal::omega].t.push_back(digit * std::floor(t / digit + 1e-9));
    run.signals[Signal::omega].value.push_back(0);
  }
  return run;
}

TEST(Sampling, AsksForMoreDigitsWhereTheyMakeTimesUneven) {
  const DataFindings found = sampling_flaws(written_at(0.00141, 0, 0.001));
  ASSERT_THAT(found, testing::SizeIs(1));
  EXPECT_EQ(found[0].what, Flaw::jitter);
  EXPECT_THAT(found[0].text, testing::HasSubstr("whole steps of 0.001 s, and the rows 0.0014"));
  EXPECT_THAT(sampling_flaws(written_at(0.0014, 0, 0.0001)), testing::IsEmpty());
}

TEST(Sampling, BlamesNoDigitsForRowsThatComeLate) {
  const DataFindings found = sampling_flaws(written_at(0.0054, 0.004, 0.001));
  ASSERT_THAT(found, testing::SizeIs(1));
  EXPECT_THAT(found[0].text, testing::HasSubstr("early or late"));
}

}  // namespace
}  // namespace emtb
