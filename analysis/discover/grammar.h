#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "analysis/discover/samples.h"
#include "model/model.h"

namespace emtb {

/// Times what drives the motor: no law is larger.
inline constexpr double largest_law = 5;

/// A formula as text, before it is read: what a file of candidates would say.
struct FormulaText {
  struct Parameter {
    std::string symbol, unit;
    double value = 0, min = 0, max = 0;
    bool amplitude = false;  ///< 0 is where the law is absent; else a shape
    bool fixed = false;      ///< held; where it has bounds it may be freed once the law is found
  };
  std::string id;
  TermPlace place = TermPlace::torque;
  std::string formula;
  std::vector<std::string> of;  ///< the quantities that it holds, the first that its curve is drawn over
  std::vector<Parameter> parameters;
  bool is_curve = false;  ///< values of a curve, as many as it takes, instead of a short formula
  std::string rate = {};  ///< dz/dt of what the formula remembers, z; empty: nothing

  /// `-a*z, dz/dt = (omega - z)/tau`
  std::string in_words() const { return rate.empty() ? formula : formula + ", dz/dt = " + rate; }

  /// The candidate as YAML, as `--candidates` reads it; ends with a newline.
  std::string yaml() const;
};

/// The part of a quantity's range within which a law turns with its sign, held where few readings tell it.
FormulaText::Parameter turning_width(const std::string& symbol, const std::string& unit, double range);

/// [s] within which what a law remembers follows: as far as the samples show it. Bounds of nothing without paths.
FormulaText::Parameter time_to_follow(const Samples& samples);

/// Reads a formula: that is the matter of who knows YAML. @throws ModelError or ConfigError
using ReadFormula = std::function<AddedTerm(const FormulaText&)>;

/// The sentences of the grammar for these samples: powers, saturations, decays, hyperbolas, dead zones, bumps and waves
/// in speed, current and reference, waves in the angle, decays in time; as a torque, a voltage or a factor on the flux.
/// At most three free parameters; the argument of each exp, tanh and sin is divided by a parameter of its own unit.
/// Bounds and first values come from the ranges that the data span.
std::vector<FormulaText> sentences(const Samples& samples, double torque_scale, double voltage_scale, bool voltage);

/// Laws that remember: those in the speed that follow within a time, friction that gives before it slips, grease that
/// the motion itself warms, torques and voltages that lag behind the current. None without paths.
std::vector<FormulaText> remembering_sentences(const Samples& samples, double torque_scale, double voltage_scale,
                                               bool voltage);

/// What a law remembers along a run. @param p its parameters, in its order
std::vector<double> memory_along(const AddedTerm& law, std::span<const double> p, const MissingTorque& run);

/// A law fitted to what is left, without a simulation.
struct EquationError {
  FormulaText law;   ///< with the values found
  double share = 0;  ///< of what is left, on runs left out; beside straight lines in speed, current and acceleration
};

/// Fits each sentence by least squares: the amplitudes linearly, the shapes on a grid. Best first; those that explain
/// nothing on runs left out are dropped.
/// @param samples of torque or voltage @param motor_torque_per_ampere [N m/A] that a factor on the flux acts with
std::vector<EquationError> by_equation_error(const Samples& samples, const std::vector<FormulaText>& laws,
                                             const ReadFormula& read, double motor_torque_per_ampere);

}  // namespace emtb
