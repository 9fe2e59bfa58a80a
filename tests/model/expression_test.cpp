#include "model/expression.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "hal/error.h"

namespace emtb {
namespace {

/// The value and derivatives of one operation on omega, i_a and theta.
struct Computed {
  double value = 0;
  TermInput by;
};

Computed compute(Operation operation, double a, double b, double c) {
  Expression e(0);
  e.set_result(e.apply(operation, Expression::quantity(0), Expression::quantity(1), Expression::quantity(2)));
  Computed y;
  y.value = e.evaluate({a, b, c, 0, 0}, {}, y.by, {});
  return y;
}

constexpr std::array smooth_operations{Operation::add,
                                       Operation::subtract,
                                       Operation::multiply,
                                       Operation::divide,
                                       Operation::power,
                                       Operation::smaller,
                                       Operation::larger,
                                       Operation::arc_tangent_of_two,
                                       Operation::choose,
                                       Operation::negate,
                                       Operation::absolute,
                                       Operation::sign,
                                       Operation::round,
                                       Operation::square_root,
                                       Operation::exponential,
                                       Operation::logarithm,
                                       Operation::sine,
                                       Operation::cosine,
                                       Operation::tangent,
                                       Operation::arc_sine,
                                       Operation::arc_cosine,
                                       Operation::arc_tangent,
                                       Operation::hyperbolic_sine,
                                       Operation::hyperbolic_cosine,
                                       Operation::less,
                                       Operation::less_or_equal,
                                       Operation::equal,
                                       Operation::both,
                                       Operation::either,
                                       Operation::hyperbolic_tangent};

TEST(Expression, DifferentiatesEveryOperation) {
  for (const Operation operation : smooth_operations) {
    SCOPED_TRACE(static_cast<int>(operation));
    const double a = 0.37, b = 0.61, c = -1.7, step = 1e-6;
    const Computed y = compute(operation, a, b, c);
    ASSERT_TRUE(std::isfinite(y.value));
    const auto slope = [&](double da, double db, double dc) {
      return (compute(operation, a + da, b + db, c + dc).value - compute(operation, a - da, b - db, c - dc).value) /
             (2 * step);
    };
    EXPECT_NEAR(y.by.omega, slope(step, 0, 0), 1e-9);
    EXPECT_NEAR(y.by.i_a, slope(0, step, 0), 1e-9);
    EXPECT_NEAR(y.by.theta, slope(0, 0, step), 1e-9);
  }
}

TEST(Expression, HasNoSlopeWhereAFunctionHasNone) {
  for (const Operation operation : {Operation::absolute, Operation::sign, Operation::square_root}) {
    EXPECT_EQ(compute(operation, 0, 0, 0).by.omega, 0) << static_cast<int>(operation);
  }
}

TEST(Expression, IsNotSpoiltByTheBranchThatIsNotChosen) {
  // omega > 0 ? sqrt(omega) : 3 omega, at -2: the root is not a number.
  Expression e(0);
  const Expression::Place omega = Expression::quantity(0);
  const auto root = e.apply(Operation::square_root, omega);
  const auto triple = e.apply(Operation::multiply, e.constant(3), omega);
  const auto positive = e.apply(Operation::less, e.constant(0), omega);
  e.set_result(e.apply(Operation::choose, positive, root, triple));
  TermInput by;
  EXPECT_EQ(e.evaluate({-2, 0, 0, 0, 0}, {}, by, {}), -6);
  EXPECT_EQ(by.omega, 3);
}

TEST(Expression, RaisesToSmallPowersByMultiplying) {
  for (int n = 1; n <= 8; ++n) {
    Expression e(0);
    e.set_result(e.apply(Operation::power, Expression::quantity(0), e.constant(n)));
    TermInput by;
    EXPECT_NEAR(e.evaluate({-1.3, 0, 0, 0, 0}, {}, by, {}), std::pow(-1.3, n), 1e-13);
    EXPECT_NEAR(by.omega, n * std::pow(-1.3, n - 1), 1e-12);
  }
}

TEST(Expression, TakesParametersAndGivesTheirDerivatives) {
  Expression e(2);  // p0 exp(-omega/p1)
  const auto exponent =
      e.apply(Operation::negate, e.apply(Operation::divide, Expression::quantity(0), Expression::parameter(1)));
  e.set_result(e.apply(Operation::multiply, Expression::parameter(0), e.apply(Operation::exponential, exponent)));
  const std::array p{0.3, 7.0};
  std::array<double, 2> by_parameter{};
  TermInput by;
  const double expected = std::exp(-4.0 / 7);
  EXPECT_DOUBLE_EQ(e.evaluate({4, 0, 0, 0, 0}, p, by, by_parameter), 0.3 * expected);
  EXPECT_DOUBLE_EQ(by_parameter[0], expected);
  EXPECT_DOUBLE_EQ(by_parameter[1], 0.3 * expected * 4 / 49);
  EXPECT_DOUBLE_EQ(by.omega, -0.3 * expected / 7);
}

TEST(Expression, RefusesToGrowForever) {
  Expression e(0);
  const auto grow = [&] {
    for (int i = 0; i < 1000; ++i) e.apply(Operation::add, Expression::quantity(0), e.constant(i));
  };
  EXPECT_THROW(grow(), ModelError);
}

}  // namespace
}  // namespace emtb
