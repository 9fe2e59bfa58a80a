#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "model/term.h"

namespace emtb {

/// What an expression can do with one, two or three numbers. Comparisons and logic give 0 or 1.
enum class Operation : std::uint8_t {
  constant,
  add,
  subtract,
  multiply,
  divide,
  power,
  arc_tangent_of_two,
  smaller,
  larger,
  less,
  less_or_equal,
  equal,
  both,
  either,
  choose,  ///< a != 0 ? b : c
  negate,
  absolute,
  sign,
  round,
  square_root,
  exponential,
  logarithm,
  sine,
  cosine,
  tangent,
  arc_sine,
  arc_cosine,
  arc_tangent,
  hyperbolic_sine,
  hyperbolic_cosine,
  hyperbolic_tangent
};

/// An expression in the quantities of TermInput and parameters, with its exact derivatives.
///
/// It is built once, one operation on what is there already after the other, and is then a flat list without branches.
/// It is evaluated from its beginning to its end, and differentiated from its end to its beginning (reverse mode of
/// automatic differentiation, Griewank and Walther 2008, ch. 3): all derivatives for about twice the price of the
/// value, however many parameters there are. Where a function has no slope (|x|, sign x or sqrt x at 0) its derivative
/// is 0. No allocation and no shared state: any number of threads may evaluate one expression.
class Expression final : public Term {
 public:
  /// Which of the values that are there: the quantities, the parameters, then what has been computed.
  using Place = std::uint16_t;
  static constexpr std::size_t quantities = 6;  ///< omega, i_a, theta, u_ref, t, memory: in this order
  static constexpr std::size_t most_values = 256;

  /// @throws ModelError where there are too many parameters.
  explicit Expression(std::size_t parameters);

  static Place quantity(std::size_t i) { return static_cast<Place>(i); }
  static Place parameter(std::size_t i) { return static_cast<Place>(quantities + i); }
  /// @throws ModelError where the expression gets too long; so does apply().
  Place constant(double value);
  /// Computes at once what depends on constants only, and only once what is computed twice.
  Place apply(Operation operation, Place a, Place b = 0, Place c = 0);
  void set_result(Place place) { result_ = place; }

  double evaluate(const TermInput& x, std::span<const double> p, TermInput& by_input,
                  std::span<double> by_parameter) const override;

 private:
  struct Step {
    Operation operation{};
    Place a = 0, b = 0, c = 0;
    double value = 0;  ///< of a constant
  };
  /// From the beginning to the end. @param v values: the quantities and parameters are there, the steps' are computed
  void compute(double* v) const;
  /// From the end to the beginning. @param d derivatives of the result with respect to the values: zeros, in; out
  void differentiate(const double* v, double* d) const;
  Place append(const Step& step);
  Place power_of(Place base, int exponent);
  std::optional<double> constant_at(Place place) const;

  std::size_t first_;  ///< place of the first step's value
  std::vector<Step> steps_;
  Place result_ = 0;
};

}  // namespace emtb
