#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "model/model.h"

namespace emtb {

/// One statement on a term of the equations, in the language that C, Octave and Modelica share: + - * /, and calls of
/// abs, sign, exp, sin, pow and those of step_text.h. `$name` is a parameter, other names are those of Balance and
/// State in model/effect.h.
struct Statement {
  std::string_view term;   ///< that it sets: `dry_friction`
  std::string_view value;  ///< `dry_friction + $T_c`
};

/// What an effect does, written down.
struct WrittenEffect {
  std::string_view id;
  std::span<const Statement> statements;
};

/// All effects that can be written in a few statements.
std::span<const WrittenEffect> written_effects() noexcept;

/// Does a term let no current flow at times? A driver does that to the circuit, whichever voltage drives the motor.
bool blocks_circuit(std::string_view term) noexcept;

/// A parameter of exported text.
struct ExportedParameter {
  std::string name;  ///< `R_a`, `coulomb_friction_T_c`: an identifier in every language
  std::string unit, about;
  double value = 0;
  double std_error = 0;  ///< 0: not known
};

/// A statement with its names resolved: parameters are `$R_a`.
struct ResolvedStatement {
  std::string term, value;
};

/// A model as equations, in the order in which a step walks through them.
struct ExportedEquations {
  std::string model;
  Signal input = Signal::u_ref;
  bool both_ways = true;  ///< the driver gives voltages below zero as well
  std::vector<ExportedParameter> parameters = {};
  std::vector<ResolvedStatement> driver = {}, machine = {};
  std::vector<std::string> included = {};  ///< ids of its effects
  std::vector<std::string> left_out = {};  ///< what describes the instruments, not the machine
};

/// The model as equations. Effects of sensors are left out: they are the instruments'.
/// @throws ModelError naming all effects and formulas that cannot be written so.
ExportedEquations equations_of(const Model& model);

}  // namespace emtb
