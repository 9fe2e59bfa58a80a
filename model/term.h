#pragma once

#include <memory>
#include <span>
#include <string>

namespace emtb {

/// What an added term may depend on, in the middle of a step.
struct TermInput {
  double omega = 0;   ///< [rad/s]
  double i_a = 0;     ///< [A]
  double theta = 0;   ///< [rad]
  double u_ref = 0;   ///< [V]
  double t = 0;       ///< [s] from the start of the run
  double memory = 0;  ///< what the term remembers; 0 where it remembers nothing
};

/// A term of the equations that is not in the catalogue: a formula of the user, or a curve to be found.
///
/// It is the same for any scalar: with its value it gives its derivatives, and the step follows the chain rule.
/// Thread-safe.
class Term {
 public:
  virtual ~Term() = default;

  /// @param p its parameters
  /// @param by_input, by_parameter out: derivatives of the value
  virtual double evaluate(const TermInput& x, std::span<const double> p, TermInput& by_input,
                          std::span<double> by_parameter) const = 0;
};

/// Where a term stands in the equations.
enum class TermPlace {
  torque,   ///< [N m] added to the shaft; accelerates
  voltage,  ///< [V] added to the armature's terminal voltage
  flux      ///< [1] factor on K_b and K_m
};

/// A term with as many parameters as it has, behind those of the effects.
///
/// What it remembers, z, follows dz/dt = rate, of the same parameters, and starts where it would last: lags, creep,
/// dry friction that gives before it slips.
struct PlacedTerm {
  TermPlace place = TermPlace::torque;
  std::shared_ptr<const Term> term;
  std::size_t parameter_count = 0;
  std::shared_ptr<const Term> rate = nullptr;  ///< null: it remembers nothing
};

}  // namespace emtb
