#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "analysis/record/error_column.h"
#include "model/model.h"
#include "model/simulation.h"
#include "session/session.h"

namespace emtb {

/// What the noise of a measured input leaves in it at each grid point, after smoothing.
struct InputNoise {
  ErrorColumn sigma;       ///< in the unit of the input; empty: none
  ErrorColumn correlated;  ///< [s] over which it stays about the same: the integral of its autocorrelation
  ErrorColumn change;      ///< from the grid point before, as sigma
};

/// The series on the grid: the reading nearest to each grid point, at most half an interval away.
/// @param what it is, for people @throws ModelError where there are holes: what drives a simulation must be known
/// throughout.
SharedColumn<double> on_grid(const Series& series, std::span<const double> grid, const std::string& what);

/// What is measured of a stage and drives the next, its noise averaged away as far as nothing changes.
struct MeasuredInput {
  std::vector<double> value;  ///< on the grid
  InputNoise noise;           ///< what is left of it
};

/// A measured speed on the grid, and how far around each sample it stands still for all that its noise tells.
struct SteadySpeed {
  std::vector<double> raw;
  std::vector<std::size_t> reach;  ///< [samples]

  std::vector<double> quiet() const;  ///< its mean over them
};
SteadySpeed steady_speed(const Run& run, std::span<const double> grid);
/// Of a run whose speed was not measured: it may stand still for as long as any mean reaches.
SteadySpeed unknown_speed(std::span<const double> grid);

/// The gauge's reading as a load, its noise averaged away where it stands still, and the speed with it: a load that
/// hangs on the speed changes with that, long before its own noise tells. Empty where it reads zero throughout: then
/// K_m, B, J and the frictions share a common factor anyway, and a load of pure noise would only add its noise.
/// @param steady how far around each sample; at most
/// @param angle of the shaft; what repeats with it in the reading is no noise
MeasuredInput measured_load(const std::string& run, const Series& torque, std::span<const double> grid,
                            std::span<const double> angle, std::vector<std::size_t> steady);

/// The measured terminal voltage, as quiet as can be without touching its edges: the driver's model plus the zero-phase
/// mean of what the measurement adds to it, over +-0.25 s but never across a corner of the voltage.
struct MeasuredVoltage : MeasuredInput {
  std::vector<double> bulge;  ///< see Excitation::e_a_bulge
};
/// @param late [samples] by which the terminals are read behind the other instruments
MeasuredVoltage measured_voltage(const std::string& run, const Series& e_a, const Excitation& x, const Model& model,
                                 double late);

/// The same of a voltage that is the model's input, whose driver nobody knows: never across a corner that is clear of
/// its noise.
MeasuredInput quiet_voltage(std::span<const double> e_a, double interval);

}  // namespace emtb
