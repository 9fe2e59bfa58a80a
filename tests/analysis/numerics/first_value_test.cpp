#include "analysis/numerics/first_value.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

/// Readings each millisecond of a voltage that goes from nothing to 5 V.
struct Rise {
  std::vector<double> t, e;

  explicit Rise(double tau) {  // [s]
    synthetic::Noise noise(1);
    for (int k = 0; k < 40; ++k) {
      t.push_back(1e-3 * k);
      e.push_back(5 * (1 - std::exp(-t.back() / tau)) + noise(0.01));
    }
  }
};

TEST(FirstValue, OfAVoltageThatJumpsIsItsFirstReading) {
  const Rise rise(0.5e-3);
  const auto first = first_value_of_what_jumps(rise.t, rise.e, 0, 0);
  ASSERT_TRUE(first);
  EXPECT_NEAR(first->value, 0, 0.03);
  EXPECT_TRUE(first->is_other_than(5));
  EXPECT_FALSE(first->is_other_than(0));
  EXPECT_FALSE(first_value(rise.t, rise.e, 0, 0)->is_other_than(5)) << "a line, of what cannot jump";
}

TEST(FirstValue, OfAVoltageThatRisesSlowlyIsThatOfTheLine) {
  const Rise rise(0.5);
  const auto first = first_value_of_what_jumps(rise.t, rise.e, 0, 0), line = first_value(rise.t, rise.e, 0, 0);
  ASSERT_TRUE(first && line);
  EXPECT_EQ(first->value, line->value);
  EXPECT_NEAR(first->slope, 10, 1);
}

}  // namespace
}  // namespace emtb
