#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "analysis/fit/residuals.h"

namespace emtb {

/// By how much the rotor of a run stands ahead of its measured angle.
///
/// Where a run starts in a turn is seldom known. Where the angle is the integral of a speed, it wanders besides
/// (Record::angle_wander), and what repeats with the angle tells by how much: the best angle is followed through
/// the run, as smooth as the wander is likely to be.
struct RotorPhase {
  std::vector<double> at;  ///< [rad] at knots evenly spread over the run, linear in between; one: the same throughout;
                           ///< none: nothing in the model repeats with the angle
  double unlikely = 0;     ///< squares of its changes from knot to knot, in units of what is likely
};

/// [rad] A move of the phase that is nearly linear, for a structure with effects that repeat with the angle.
double longest_move(const ModelStructure& structure, std::span<const double> values);

/// The phase at which the run fits best, for a structure with effects that repeat with the angle.
/// @param near what it was for values like these: one step from there, in place of a search in all of the turn
RotorPhase best_phase(const Record& record, const ModelStructure& structure, std::span<const double> values,
                      const RotorPhase* near = nullptr);

/// What is known of a turn beside the readings, as it adds to the normal equations of p parameters: their changes
/// change the best phase, and how likely that is.
struct PhasePrior {
  Eigen::MatrixXd sts;  ///< p x p; empty: nothing
  Eigen::VectorXd str;  ///< p
};

/// Where the best phase of a record goes, to first order, as p parameters change.
struct PhaseCourse {
  Eigen::VectorXd ahead;         ///< [rad] at each knot: from where it is, with the parameters as they are
  Eigen::MatrixXd by_parameter;  ///< knots x p, [rad] per unit: what a rise of each takes away
  double longest = 0;            ///< [rad] of a move that is nearly linear

  bool known() const { return ahead.size() > 0; }
  Eigen::VectorXd move(const Eigen::VectorXd& change) const;  ///< [rad] of the knots, as the parameters change
  bool is_sure(const Eigen::VectorXd& change) const;          ///< by moves so short that what is linear holds
  RotorPhase from(const Record& record, const RotorPhase& phase, const Eigen::VectorXd& change) const;
};

/// Of several records, in their order.
using RotorPhases = std::vector<RotorPhase>;

struct ResidualsAtPhase {
  std::vector<Residuals> residuals;
  PhasePrior prior;
  PhaseCourse course;  ///< known where something is moved and repeats with the angle
};

/// Of the steps of a simulation: as the record asks, or at most half as long, which tells what their length does.
enum class StepLength { usual, half };

/// The residuals of one record at a known phase; what a little more of it would do is projected off the sensitivities:
/// the residuals are those at its best value, whatever the parameters are (variable projection after Kaufman, 1975).
ResidualsAtPhase residuals_at_phase(const Record& record, const ModelStructure& structure,
                                    std::span<const double> values, std::span<const std::vector<std::size_t>> moved,
                                    const RotorPhase& phase, StepLength steps = StepLength::usual);

struct ResidualsAtPhases {
  RotorPhases phases;
  std::vector<Residuals> residuals;
};

/// The phases at which records fit best, and the residuals of all of them there: residuals(), and where it looked.
/// @param near as for best_phase(), of each record; empty: searched
ResidualsAtPhases residuals_at_best_phases(std::span<const Record> records, const Model& model,
                                           std::span<const double> values,
                                           std::span<const std::vector<std::size_t>> moved,
                                           std::span<const RotorPhase> near = {});

struct SquaresAtPhases {
  RotorPhases phases;
  double squares = 0;  ///< sum of all squared residuals
};

/// The same where no residual by itself is asked for: none is kept.
SquaresAtPhases squares_at_best_phases(std::span<const Record> records, const Model& model,
                                       std::span<const RotorPhase> near = {});

}  // namespace emtb
