#pragma once

#include <string>
#include <vector>

#include "export/equations.h"

namespace emtb {

/// A step of a model as assignments that C and Octave read alike, once names are spelt.
///
///     `$name` a parameter, `@name` a state or a reading, other names are local
///
/// It is what model/step.h does: the armature circuit exactly for a voltage that is linear over the step, the shaft by
/// the trapezoidal rule fitted to its own decay, dry friction by a threshold that keeps the shaft at rest while it
/// holds.
/// It calls functions that the exporter of a language provides:
///
///     beyond(x, limit)            x less as much of it as the limit takes: 0 where |x| <= limit
///     positive(x)                 1 where x > 0, else 0
///     clamp(x, low, high)
///     slew_end, slew_mean(e, target, rise, fall, h)      of an output that follows no faster than its limits
///     lag_end(before, start, end, tau, h)                of a first-order lag behind a ramp
///     mean_sine(x, width)         of an angle that goes so far in the step
///     carried(h, tau)             exp(-h/tau), 0 where tau is 0
///     drop_for(stopping, ohm, drop, knee)                what brushes take of the voltage
///     reacting(with_all, taken, from, reaction, knee)    the current of a flux that it weakens itself
struct StepText {
  std::vector<ResolvedStatement> assignments;
  std::vector<std::string> locals;  ///< names that C declares
};

/// Is there a driver that lets no current flow at times?
bool may_block(const ExportedEquations& x);

/// What a step keeps and gives, in the order of the exported structures.
struct StateText {
  std::string name, unit, about;
};
std::vector<StateText> states_of(const ExportedEquations& equations);

/// @param input what the function's argument is called: `u_ref`, `e_a` or `i_a_ref`
StepText step_of(const ExportedEquations& equations, const std::string& input);

/// The argument that drives a step, by the model's input, and its unit.
std::string input_name(Signal input);
std::string input_unit(Signal input);

/// A text with each `$name` and `@name` spelt by a language.
std::string spelt(const std::string& text, const std::string& parameters, const std::string& states);

/// A number that reads back as it is.
std::string exact(double value);

/// Calls of functions under other names: `abs(` as `fabs(`.
std::string renamed(std::string text, const std::string& from, const std::string& to);

}  // namespace emtb
