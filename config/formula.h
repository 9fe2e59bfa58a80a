#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "model/term.h"

namespace emtb {

/// Reads a formula of the user, such as `-c3*omega^3`.
///
/// It may use omega [rad/s], i_a [A], theta [rad], u_ref [V], t [s], its own parameters, pi, + - * / ^, comparisons,
/// && and ||, `condition ? this : that`, and the functions that formula_functions() lists. Angles are in rad, log is
/// the natural one. muParser reads it; the result knows muParser no more: it is evaluated and differentiated by
/// Expression, from any number of threads (docs/decisions/formulas.md).
/// @param parameters their symbols, in the order in which the term takes them
/// @throws ModelError where it cannot be read, names what is not known, or leaves a parameter unused: what is wrong
/// with it and where, to stand behind the formula's key.
std::shared_ptr<const Term> parse_formula(const std::string& text, std::span<const std::string> parameters);

/// One of the formulas of a term that remembers something.
struct ParsedFormula {
  std::shared_ptr<const Term> term;
  bool uses_memory = false;
  std::vector<bool> uses;  ///< each parameter
};

/// The same for a formula that may use what the term remembers, and not all parameters.
/// @param memory the name of what is remembered
/// @throws ModelError where it cannot be read, or names what is not known.
ParsedFormula parse_formula_with(const std::string& memory, const std::string& text,
                                 std::span<const std::string> parameters);

/// @param uses which of the parameters formulas use @throws ModelError naming the first that they do not.
void check_all_used(std::span<const std::string> parameters, const std::vector<bool>& uses);

/// `sin, cos, ...`
std::string formula_functions();

/// Does the language of formulas give this name a meaning of its own: a quantity, a function, a constant?
bool means_something_in_formulas(std::string_view name);

}  // namespace emtb
