#include "model/expression.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "hal/error.h"

namespace emtb {
namespace {

double sign_of(double x) { return x > 0 ? 1 : x < 0 ? -1 : 0; }

double computed(Operation operation, double a, double b, double c) {
  switch (operation) {
    case Operation::constant:
      return a;
    case Operation::add:
      return a + b;
    case Operation::subtract:
      return a - b;
    case Operation::multiply:
      return a * b;
    case Operation::divide:
      return a / b;
    case Operation::power:
      return std::pow(a, b);
    case Operation::arc_tangent_of_two:
      return std::atan2(a, b);
    case Operation::smaller:
      return b < a ? b : a;
    case Operation::larger:
      return a < b ? b : a;
    case Operation::less:
      return a < b ? 1 : 0;
    case Operation::less_or_equal:
      return a <= b ? 1 : 0;
    case Operation::equal:
      return a == b ? 1 : 0;
    case Operation::both:
      return a != 0 && b != 0 ? 1 : 0;
    case Operation::either:
      return a != 0 || b != 0 ? 1 : 0;
    case Operation::choose:
      return a != 0 ? b : c;
    case Operation::negate:
      return -a;
    case Operation::absolute:
      return std::abs(a);
    case Operation::sign:
      return sign_of(a);
    case Operation::round:
      return std::nearbyint(a);
    case Operation::square_root:
      return std::sqrt(a);
    case Operation::exponential:
      return std::exp(a);
    case Operation::logarithm:
      return std::log(a);
    case Operation::sine:
      return std::sin(a);
    case Operation::cosine:
      return std::cos(a);
    case Operation::tangent:
      return std::tan(a);
    case Operation::arc_sine:
      return std::asin(a);
    case Operation::arc_cosine:
      return std::acos(a);
    case Operation::arc_tangent:
      return std::atan(a);
    case Operation::hyperbolic_sine:
      return std::sinh(a);
    case Operation::hyperbolic_cosine:
      return std::cosh(a);
    case Operation::hyperbolic_tangent:
      return std::tanh(a);
  }
  return a;
}

/// The derivatives of an operation's value y with respect to what it was computed from.
struct Slopes {
  double a = 0, b = 0, c = 0;
};

Slopes slopes_of(Operation operation, double a, double b, double y) {
  switch (operation) {
    case Operation::divide:
      return {1 / b, -y / b};
    case Operation::power:
      return {a != 0 ? b * y / a : b * std::pow(a, b - 1), 0};  // by the exponent: see differentiate()
    case Operation::arc_tangent_of_two:
      return {b / (a * a + b * b), -a / (a * a + b * b)};
    case Operation::smaller:
      return b < a ? Slopes{0, 1} : Slopes{1, 0};
    case Operation::larger:
      return a < b ? Slopes{0, 1} : Slopes{1, 0};
    case Operation::choose:
      return a != 0 ? Slopes{0, 1, 0} : Slopes{0, 0, 1};
    case Operation::absolute:
      return {sign_of(a)};
    case Operation::square_root:
      return {0.5 / y};
    case Operation::exponential:
      return {y};
    case Operation::logarithm:
      return {1 / a};
    case Operation::sine:
      return {std::cos(a)};
    case Operation::cosine:
      return {-std::sin(a)};
    case Operation::tangent:
      return {1 + y * y};
    case Operation::arc_sine:
      return {1 / std::sqrt(1 - a * a)};
    case Operation::arc_cosine:
      return {-1 / std::sqrt(1 - a * a)};
    case Operation::arc_tangent:
      return {1 / (1 + a * a)};
    case Operation::hyperbolic_sine:
      return {std::cosh(a)};
    case Operation::hyperbolic_cosine:
      return {std::sinh(a)};
    case Operation::hyperbolic_tangent:
      return {1 - y * y};
    default:
      return {};  // what jumps; the simplest stand in differentiate()
  }
}

std::size_t operands_of(Operation operation) {
  if (operation == Operation::choose) return 3;
  return operation < Operation::choose ? 2 : 1;
}

}  // namespace

Expression::Expression(std::size_t parameters) : first_(quantities + parameters) {
  if (first_ > most_values / 2) throw ModelError("has " + std::to_string(parameters) + " parameters: too many");
}

std::optional<double> Expression::constant_at(Place place) const {
  if (place < first_ || steps_[place - first_].operation != Operation::constant) return {};
  return steps_[place - first_].value;
}

Expression::Place Expression::append(const Step& step) {
  const auto same = std::ranges::find_if(steps_, [&](const Step& s) {
    return s.operation == step.operation && s.a == step.a && s.b == step.b && s.c == step.c && s.value == step.value;
  });
  if (same != steps_.end()) return static_cast<Place>(first_ + static_cast<std::size_t>(same - steps_.begin()));
  if (first_ + steps_.size() >= most_values) {
    throw ModelError("is longer than " + std::to_string(most_values) + " operations");
  }
  steps_.push_back(step);
  return static_cast<Place>(first_ + steps_.size() - 1);
}

Expression::Place Expression::constant(double value) { return append({Operation::constant, 0, 0, 0, value}); }

Expression::Place Expression::power_of(Place base, int exponent) {
  if (exponent == 1) return base;
  const Place half = power_of(base, exponent / 2);
  const Place even = apply(Operation::multiply, half, half);
  return exponent % 2 == 0 ? even : apply(Operation::multiply, even, base);
}

Expression::Place Expression::apply(Operation operation, Place a, Place b, Place c) {
  const std::size_t operands = operands_of(operation);
  const std::optional<double> x = constant_at(a), y = operands > 1 ? constant_at(b) : 0.0,
                              z = operands > 2 ? constant_at(c) : 0.0;
  if (x && y && z) return constant(computed(operation, *x, *y, *z));
  if (operation == Operation::power && y && *y >= 1 && *y <= 8 && *y == std::floor(*y)) {
    return power_of(a, static_cast<int>(*y));  // twenty times faster than pow()
  }
  return append({operation, a, b, c, 0});
}

double Expression::evaluate(const TermInput& x, std::span<const double> p, TermInput& by_input,
                            std::span<double> by_parameter) const {
  std::array<double, most_values> value;  // only as far as it is used: to clear it all would take longer than the rest
  value[0] = x.omega;
  value[1] = x.i_a;
  value[2] = x.theta;
  value[3] = x.u_ref;
  value[4] = x.t;
  value[5] = x.memory;
  std::ranges::copy(p, value.begin() + quantities);
  compute(value.data());

  std::array<double, most_values> by;
  std::fill_n(by.begin(), first_ + steps_.size(), 0.0);
  differentiate(value.data(), by.data());
  by_input = {by[0], by[1], by[2], by[3], by[4], by[5]};
  std::copy_n(by.begin() + quantities, by_parameter.size(), by_parameter.begin());
  return value[result_];
}

void Expression::compute(double* v) const {
  // What formulas mostly consist of is computed here, without a call.
  for (std::size_t i = 0; i < steps_.size(); ++i) {
    const Step& s = steps_[i];
    double& value = v[first_ + i];
    switch (s.operation) {
      case Operation::constant:
        value = s.value;
        break;
      case Operation::add:
        value = v[s.a] + v[s.b];
        break;
      case Operation::subtract:
        value = v[s.a] - v[s.b];
        break;
      case Operation::multiply:
        value = v[s.a] * v[s.b];
        break;
      case Operation::negate:
        value = -v[s.a];
        break;
      default:
        value = computed(s.operation, v[s.a], v[s.b], v[s.c]);
    }
  }
}

void Expression::differentiate(const double* v, double* d) const {
  d[result_] = 1;
  for (std::size_t i = first_ + steps_.size(); i-- > first_;) {
    const double from = d[i];
    if (from == 0) continue;  // also: a branch that was not chosen may be NaN
    const Step& s = steps_[i - first_];
    switch (s.operation) {
      case Operation::constant:
        break;
      case Operation::add:
        d[s.a] += from;
        d[s.b] += from;
        break;
      case Operation::subtract:
        d[s.a] += from;
        d[s.b] -= from;
        break;
      case Operation::multiply:
        d[s.a] += from * v[s.b];
        d[s.b] += from * v[s.a];
        break;
      case Operation::negate:
        d[s.a] -= from;
        break;
      default: {
        Slopes slopes = slopes_of(s.operation, v[s.a], v[s.b], v[i]);
        if (s.operation == Operation::power && !constant_at(s.b)) slopes.b = v[i] * std::log(v[s.a]);
        const auto hand_on = [&](Place to, double slope) {
          if (slope != 0 && std::isfinite(slope)) d[to] += from * slope;
        };
        hand_on(s.a, slopes.a);
        hand_on(s.b, slopes.b);
        hand_on(s.c, slopes.c);
      }
    }
  }
}

}  // namespace emtb
