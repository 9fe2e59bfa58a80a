#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hal/signal.h"
#include "model/effect.h"
#include "model/term.h"

namespace emtb {

/// What is known of the driver (figure 8 of Erdal et al. 2011: 22.5 and -20.4 V/s). Absent from the model file: ideal.
struct DriverModel {
  static constexpr double unlimited = 1e12;  ///< larger than any bench, small enough to compute with

  double gain = 1;          ///< [V/V]
  double rise = unlimited;  ///< [V/s]
  double fall = unlimited;  ///< [V/s], positive
  double min = -unlimited;  ///< [V]
  double max = unlimited;   ///< [V]

  /// [V] What feeds it, as far as its limits say, one of which may be all that is known; `unlimited`: they do not.
  double supply() const {
    const double up = max < unlimited ? max : 0, down = -min < unlimited ? -min : 0;
    return up > 0 || down > 0 ? std::max(up, down) : unlimited;
  }
};

/// The base parameters of equations (1)-(5), always present, in this order.
struct BaseParameter {
  std::string_view symbol;
  std::string_view unit;
  std::string_view name;
  ChangeWords changed;  ///< what a change of it tells
};
inline constexpr std::array<BaseParameter, 5> base_parameters{
    {{"R_a", "ohm", "armature resistance", {"the armature has", "has it warmed up?", "has it cooled down?"}},
     {"K_b",
      "V s/rad",
      "back-EMF constant",
      {"back-EMF and torque constant are", "a stronger field?", "has the field weakened, or warmed up?"}},
     {"K_m",
      "N m/A",
      "torque constant",
      {"the torque constant is", "a stronger field?", "has the field weakened, or warmed up?"}},
     {"B",
      "N m s/rad",
      "viscous friction",
      {"viscous friction is", "does something drag on the shaft?", "has the grease warmed up?"}},
     {"J",
      "kg m2",
      "inertia",
      {"the inertia is", "was something added to the shaft?", "was something taken from the shaft?"}}}};

/// Their places: the first ones in every vector of parameters.
namespace base {
enum : std::size_t { R_a, K_b, K_m, B, J };
}
static_assert(base_parameters[base::R_a].symbol == "R_a" && base_parameters[base::J].symbol == "J");

/// Which equations a simulation solves; the numbers in them come apart from it, as a vector in the order
/// R_a, K_b, K_m, B, J, then the parameters of each effect, then those of each added term.
struct ModelStructure {
  static constexpr std::size_t base_count = base_parameters.size();

  Signal input = Signal::u_ref;  ///< u_ref, e_a, or i_a for a current drive
  DriverModel driver;
  std::vector<std::size_t> effects;  ///< places in the catalogue, ascending: the order of the stages
  std::vector<PlacedTerm> terms;     ///< that the catalogue does not have

  bool measured_voltage = false;  ///< the motor is driven by the measured e_a, the driver predicts e_a on its own
  bool measured_load = false;     ///< the shaft is loaded by the measured torque, load effects predict it on their own

  std::size_t parameter_count() const;
};

/// The state at the start of a run.
struct InitialState {
  double omega = 0;           ///< [rad/s]
  double theta = 0;           ///< [rad]
  std::optional<double> i_a;  ///< [A]; absent: none, or of a shaft that was read to turn, what voltage and speed leave
  std::optional<double> e_driver;  ///< [V] at its terminals; absent: settled at the first reference
  double e_driver_slope = 0;       ///< [V/s] with which it moves: what a lag of the driver has yet to follow
  bool as_read = false;            ///< omega and i_a, where they are not 0, are readings, with all that sensors err
  double field_on = 0;             ///< [s] for which the field has been on
  double omega_doubt = 0;          ///< [rad/s] that the first readings may mean as well as the rest that they stand for
};

}  // namespace emtb
