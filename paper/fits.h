#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "model/model.h"
#include "session/session.h"

namespace emtb::paper {

/// A fit by output error, with what the page tells of it.
struct OutputErrorFit {
  std::string name;
  Model model;
  double error = 0;  ///< in units of the noise floor
  std::vector<double> singular_values = {};
  std::size_t free = 0, determined = 0;  ///< parameters, and combinations of them that the data fix to 10 %

  double at(const std::string& parameter) const;
  double gain() const;           ///< [rad/(V s)] of the linear model, from voltage to speed
  double time_constant() const;  ///< [s]
};

/// The paper's linear model with its driver, all parameters fixed.
Model linear_model(double R_a, double K_b, double K_m, double B, double J);
Model with_friction(Model model, double T_c);

/// Frees these parameters between bounds.
struct Range {
  std::string parameter;
  double min = 0, max = 0;
};
Model freed(Model model, const std::vector<Range>& ranges);
Model starting_from(Model model, const std::map<std::string, double>& values);

/// What of a run the fit may see.
inline const std::vector<Signal> speed_only{Signal::u_ref, Signal::omega};
inline const std::vector<Signal> speed_and_current{Signal::u_ref, Signal::e_a, Signal::omega, Signal::i_a};
inline const std::vector<Signal> with_torque{Signal::u_ref, Signal::e_a, Signal::omega, Signal::i_a, Signal::torque};

/// Fits from the model's own values alone (as the paper's tool does), to the speed and current among `seen`.
OutputErrorFit fit(std::string name, const std::vector<Run>& runs, const std::vector<Signal>& seen, const Model& model);

/// The error of a model as it stands.
double error_of_model(const std::vector<Run>& runs, const std::vector<Signal>& seen, const Model& model);

/// The speed that a model predicts at each reading of the run's speed, driven by its reference.
std::vector<double> simulated_speed(const Run& run, const Model& model);

}  // namespace emtb::paper
