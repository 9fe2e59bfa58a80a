#pragma once

#include <string>
#include <vector>

#include "export/equations.h"
#include "model/model.h"

namespace emtb {

/// Where a machine runs when it is looked at for small changes.
struct WorkingPoint {
  double omega = 0;  ///< [rad/s]
  double load = 0;   ///< [N m] that a load takes
};

/// A machine for small changes about a working point, where it is settled:
///
///     e = R i + L di/dt + K_b omega,    K_m i = J domega/dt + B omega + load,    lag de/dt + e = gain u
struct LinearMachine {
  double R = 0, L = 0;             ///< [ohm], [H]; R with the driver's own
  double K_b = 0, K_m = 0;         ///< [V s/rad], [N m/A]
  double B = 0, J = 0;             ///< [N m s/rad], [kg m2]
  double gain = 1;                 ///< [V/V]
  double lag = 0, delay = 0;       ///< [s]
  double i_a = 0, e_a = 0;         ///< [A], [V] at the working point; e_a before the driver's resistance
  double torque = 0, voltage = 0;  ///< [N m], [V] that remain at zero: of T(omega), e(i, omega) as straight lines
};

/// @throws ModelError where an effect with a memory of its own, or one that springs, is in the model: it has no place
/// in a machine of this kind; and where dry friction meets a working point at rest.
LinearMachine linearise(const Model& model, const WorkingPoint& at);

/// Ids of what makes a model differ from its linear machine, wherever it runs.
std::vector<std::string> not_linear(const Model& model);

/// [rad/s] at which a machine settles without a load at the driver's highest voltage; 100 where it has no limit.
double top_speed(const Model& model);

/// [N m] that friction and the loads of the model take at a speed.
double braking_torque_at(const Model& model, double omega);

/// dx/dt = A x + B u, y = C x; rows of each.
struct StateSpace {
  std::vector<std::string> states, inputs, outputs;
  std::vector<std::vector<double>> A, B, C, D;
};
StateSpace state_space(const LinearMachine& machine, Signal input);

/// numerator/denominator, highest power of s first.
struct TransferFunction {
  std::string from, to;
  std::vector<double> numerator, denominator;
};
std::vector<TransferFunction> transfer_functions(const LinearMachine& machine, Signal input);

/// Either as JSON, each coefficient with the standard error that the parameters' bring about, as if they were
/// independent: a model file holds no covariance.
std::string state_space_json(const Model& model, const WorkingPoint& at);
std::string transfer_functions_json(const Model& model, const WorkingPoint& at);

/// A linear machine as equations, for the texts of export_text.h.
/// @throws ModelError where the driver acts late: C, Octave and Modelica texts have no memory for that.
ExportedEquations linear_equations(const Model& model, const WorkingPoint& at);

}  // namespace emtb
