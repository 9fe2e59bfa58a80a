#include "config/formula.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <thread>
#include <vector>

#include "hal/error.h"

namespace emtb {
namespace {

using testing::AllOf;
using testing::HasSubstr;

const std::vector<std::string> a_and_b{"a", "b"};
const TermInput somewhere{.omega = 2.3, .i_a = -0.7, .theta = 0.4, .u_ref = 3.1, .t = 1.9};

double formula_value(const std::string& text, const TermInput& x = somewhere) {
  const auto term = parse_formula(text, {});
  TermInput by;
  return term->evaluate(x, {}, by, {});
}

TEST(Formula, ANulEndsNoFormulaEarly) {
  const std::vector<std::string> none;
  EXPECT_THROW(parse_formula(std::string("-omega\0^3", 9), none), ModelError);
}

TEST(Formula, SpeaksTheLanguageThatItPromises) {
  const auto& [omega, i_a, theta, u_ref, t, memory] = somewhere;
  EXPECT_DOUBLE_EQ(formula_value("omega + i_a*theta - u_ref/t"), omega + i_a * theta - u_ref / t);
  EXPECT_DOUBLE_EQ(formula_value("-omega^2"), -omega * omega) << "a power binds tighter than a sign";
  EXPECT_DOUBLE_EQ(formula_value("2^3^2"), 512);
  EXPECT_DOUBLE_EQ(formula_value("omega^-1.5"), std::pow(omega, -1.5));
  EXPECT_DOUBLE_EQ(formula_value("+omega - -3e-1"), omega + 0.3);
  EXPECT_DOUBLE_EQ(formula_value("sin(pi/6) + cos(2*pi)"), std::sin(std::numbers::pi / 6) + 1);
  EXPECT_DOUBLE_EQ(formula_value("abs(i_a)*sign(i_a) + sqrt(omega) + exp(i_a) + log(omega) - ln(omega)"),
                   i_a + std::sqrt(omega) + std::exp(i_a));
  EXPECT_DOUBLE_EQ(formula_value("tanh(omega/2) + atan2(i_a, omega)"), std::tanh(omega / 2) + std::atan2(i_a, omega));
  EXPECT_DOUBLE_EQ(formula_value("min(omega, i_a, t) + max(1, u_ref)"), i_a + u_ref);
  EXPECT_DOUBLE_EQ(formula_value("omega > 2 ? 10 : 20"), 10);
  EXPECT_DOUBLE_EQ(formula_value("omega <= 2 ? 10 : i_a < 0 && t != 0 ? 30 : 40"), 30) << "one condition after another";
  EXPECT_DOUBLE_EQ(formula_value("omega > 2 ? i_a > 0 ? 1 : 2 : 3"), 2) << "one within another";
  EXPECT_DOUBLE_EQ(formula_value("(omega >= 3 || i_a == 0) + 5"), 5);
}

/// d(formula)/dx by differences of second order, extrapolated once (Ridders).
template <class At>
double slope(const At& at, double x) {
  const auto central = [&](double step) { return (at(x + step) - at(x - step)) / (2 * step); };
  const double step = 1e-3;
  return (4 * central(step / 2) - central(step)) / 3;
}

TEST(Formula, DerivativesAgreeWithDifferences) {
  for (const char* text :
       {"-a*omega^3 + b*omega", "a*omega*abs(omega)*exp(-b*t)", "a*tanh(omega/b)", "-sign(omega)*a*abs(omega)^b",
        "a*sin(b*theta) - i_a*omega", "1 - a*abs(i_a)/(b + abs(i_a))", "omega > 1 ? a*omega : b*omega^2",
        "min(a, b*omega)*u_ref", "a*atan(omega/b) + sqrt(a^2 + omega^2)"}) {
    SCOPED_TRACE(text);
    const auto term = parse_formula(text, a_and_b);
    const auto value = [&](const TermInput& x, double a, double b) {
      TermInput by;
      std::vector<double> by_parameter(2);
      return term->evaluate(x, std::vector{a, b}, by, by_parameter);
    };
    const double a = 0.4, b = 1.7;
    TermInput by;
    std::vector<double> by_parameter(2);
    term->evaluate(somewhere, std::vector{a, b}, by, by_parameter);
    for (const auto part : {&TermInput::omega, &TermInput::i_a, &TermInput::theta, &TermInput::u_ref, &TermInput::t}) {
      const auto at = [&](double x) {
        TermInput moved = somewhere;
        moved.*part = x;
        return value(moved, a, b);
      };
      EXPECT_NEAR(by.*part, slope(at, somewhere.*part), 1e-9);
    }
    EXPECT_NEAR(by_parameter[0], slope([&](double x) { return value(somewhere, x, b); }, a), 1e-9);
    EXPECT_NEAR(by_parameter[1], slope([&](double x) { return value(somewhere, a, x); }, b), 1e-9);
  }
}

TEST(Formula, MayBeEvaluatedByManyThreadsAtOnce) {
  const auto term = parse_formula("a*sin(omega)*exp(-b*i_a) + (omega > 0 ? omega^2.5 : 0)", a_and_b);
  const auto sum = [&](double from) {
    double all = 0;
    TermInput by;
    std::vector<double> by_parameter(2);
    for (int k = 0; k < 2000; ++k) {
      all += term->evaluate({from + 1e-3 * k, 0.1, 0, 0, 0}, std::vector{0.3, 0.2}, by, by_parameter) + by.omega;
    }
    return all;
  };
  std::vector<double> alone(4), together(4);
  for (std::size_t i = 0; i < 4; ++i) alone[i] = sum(static_cast<double>(i));
  {
    std::vector<std::jthread> threads;
    for (std::size_t i = 0; i < 4; ++i) threads.emplace_back([&, i] { together[i] = sum(static_cast<double>(i)); });
  }
  EXPECT_EQ(alone, together);
}

std::string refusal(const std::string& text) {
  try {
    parse_formula(text, a_and_b);
  } catch (const ModelError& e) {
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos) << "a message is one line";
    return e.what();
  }
  return "";
}

TEST(Formula, SaysWhatItCannotRead) {
  EXPECT_EQ(refusal("a*omega + b"), "");
  EXPECT_THAT(refusal("a*speed + b"), AllOf(HasSubstr("uses `speed` at column 3"), HasSubstr("omega, i_a"),
                                            HasSubstr("a, b"), HasSubstr("tanh")));
  EXPECT_THAT(refusal("a*B*b"), HasSubstr("uses `B` at column 3"));
  EXPECT_THAT(refusal("a*sine(b)"), HasSubstr("uses `sine` at column 3"));
  EXPECT_THAT(refusal("a*$b"), HasSubstr("column 3"));
  EXPECT_THAT(refusal("a*omega + b*"), HasSubstr("ends too early"));
  EXPECT_THAT(refusal("a*(omega + b"), HasSubstr("bracket"));
  EXPECT_THAT(refusal("a*omega) + b"), HasSubstr("column 8"));
  EXPECT_THAT(refusal("a**b"), HasSubstr("column 3"));
  EXPECT_THAT(refusal("a omega b"), HasSubstr("column 3"));
  EXPECT_THAT(refusal(""), HasSubstr("empty"));
  EXPECT_THAT(refusal("  "), HasSubstr("empty"));
  EXPECT_THAT(refusal("a, b"), HasSubstr("several results"));
  EXPECT_THAT(refusal("a = b"), HasSubstr("=="));
  EXPECT_THAT(refusal("a*omega"), HasSubstr("does not use its parameter b"));
  EXPECT_THAT(refusal("sin(a, b)"), HasSubstr("too many arguments"));
  EXPECT_THAT(refusal("a*b*atan2(omega)"), HasSubstr("too few arguments"));
  EXPECT_THAT(refusal("a*\"b\""), HasSubstr("column"));
  std::string endless = "a + b";
  for (int i = 0; i < 500; ++i) endless += " + sin(" + std::to_string(i) + "*omega)";
  EXPECT_THAT(refusal(endless), HasSubstr("longer than"));
}

}  // namespace
}  // namespace emtb
