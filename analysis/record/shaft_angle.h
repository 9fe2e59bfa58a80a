#pragma once

#include <optional>
#include <span>
#include <vector>

#include "session/session.h"

namespace emtb {

struct MeasuredAngle {
  std::vector<double> angle;  ///< [rad] at each time of the grid, counted from the first reading; may be empty
  bool wanders = false;       ///< it is the integral of a speed, and its wander could not be taken out
};

/// The angle of the shaft as measured: the encoder's, or the integral of a speed that is read fast; empty where there
/// is neither.
///
/// Noise makes an integral wander: white noise of 0.3 rad/s at 1 kHz by 0.1 rad in two minutes, coloured noise by
/// several times that, and an offset of the tachogenerator without end. Where the speed's reading itself repeats with
/// the angle (a ripple of the tachogenerator, cogging), its phase says by how much, and the wander is taken out; so is
/// what a lag of the tachogenerator leaves the integral behind by, where the ripple's phase over the speed tells it.
/// @param order with which the speed repeats, see ripple_order(); absent: none
MeasuredAngle measured_angle(const Run& run, std::span<const double> grid, std::optional<double> order);

/// The order of the shaft [1/turn] with which the speeds of runs repeat: of those that stand out in single runs, the
/// one that explains most in all of them. At a single speed an order looks like those that alias with it, whose phase
/// would lead the angle astray. Absent, too, where it fades as the shaft turns faster: then it is not of the
/// tachogenerator, but of something that pulls at the shaft.
std::optional<double> ripple_order(std::span<const Run> runs);

/// Takes the wander out of an angle that was integrated from a speed that repeats with it, order by order of the shaft.
/// No change where no order of the shaft stands out.
/// @param angle [rad] at each reading @param omega [rad/s] the readings @param interval [s] between them
/// @param order of the shaft; absent: the one that stands out most
/// @return whether one did
bool tie_to_ripple(std::span<double> angle, std::span<const double> omega, double interval,
                   std::optional<double> order = {});

}  // namespace emtb
