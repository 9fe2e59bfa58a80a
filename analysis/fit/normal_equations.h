#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "analysis/fit/calibrate.h"
#include "analysis/fit/rotor_phase.h"
#include "analysis/record/record.h"
#include "model/model.h"

namespace emtb {

/// What a piece of a run says: its part of SᵀS and of Sᵀr.
struct Block {
  Eigen::MatrixXd sts;
  Eigen::VectorXd str;

  Block& operator+=(const Block& other);
};

/// The blocks of a run: the shortest pieces (shortest_piece()), two of them, four, eight, sixteen. Which of them are
/// independent hangs on how long the model's error remembers.
using Blocks = std::array<std::vector<Block>, 5>;

/// The normal equations of one model on all records: SᵀS, Sᵀr, rᵀr, and for judging what they say the part of each
/// block, and by how much Sᵀr would change were the simulation exact.
struct NormalEquations {
  Eigen::MatrixXd sts;
  Eigen::VectorXd str;
  double rtr = 0;
  Blocks blocks;
  Eigen::MatrixXd
      rounding;  ///< what errors that last for whole stretches (Observation::rounded) add to the scatter of Sᵀr
  Eigen::VectorXd str_of_step;

  NormalEquations& operator+=(const NormalEquations& other);
};

/// A model, its free parameters and the records that it is fitted to: what a descent asks for its normal equations. The
/// rotor phases of the records are followed from one call to the next.
class FitProblem {
 public:
  FitProblem(std::span<const Record> records, const Model& model, const CalibrationOptions& options);

  const FreeParameters& free() const { return free_; }
  const Model& given() const { return model_; }  ///< with the values from which the fit starts
  bool quick_errors() const { return options_.quick_errors; }

  /// Where in a turn the records start is searched anew, in all of the turn, unless it is given; else it is followed
  /// from one call to the next.
  void search_phases() const { followed_ = {.phases = options_.phases}; }

  /// Whether the phases change in the course of a record.
  bool phases_wander() const {
    return model_.periodic() && std::ranges::any_of(records_, [](const Record& r) { return r.angle_wander > 0; });
  }

  /// As far as they have been followed.
  const RotorPhases& phases() const { return followed_.phases; }

  /// Searches the phases anew where they have been followed to. @return whether that lowers the cost by a share
  bool finds_better_phases(std::span<const double> x, double share) const;

  /// @param to_judge with what tells how good an optimum is
  NormalEquations normal_equations(std::span<const double> x, bool with_sensitivities, bool to_judge) const;

  /// The same of each record by itself, without the priors.
  std::vector<NormalEquations> of_each(std::span<const double> x, bool with_sensitivities) const;

  /// Their sum, with the priors.
  NormalEquations sum_of(std::span<const NormalEquations> each, std::span<const double> x) const;

 private:
  /// Where the rotor phases have been followed to: the values at which the cost was least, and how the phases go on
  /// from there as the values change; unknown after a call without sensitivities.
  struct Followed {
    RotorPhases phases;  ///< of each record; empty: to be searched
    std::vector<double> x = {};
    std::vector<PhaseCourse> courses = {};
    double cost = std::numeric_limits<double>::infinity();
  };

  /// Of one record at these values and that phase; how it goes on is written to `course`.
  NormalEquations of_record(std::size_t i, std::span<const double> values, bool with_sensitivities, bool to_judge,
                            const RotorPhase& phase, PhaseCourse& course) const;

  /// @param by_courses the phases, which are known
  std::vector<NormalEquations> of_each(std::span<const double> x, bool with_sensitivities, bool to_judge,
                                       bool by_courses) const;

  /// From where the phases have been followed to, to these values.
  Eigen::VectorXd change_to(std::span<const double> x) const;

  /// Do the courses lead to these values by moves that are nearly linear?
  bool courses_are_sure(std::span<const double> x) const;

  /// The phase of a record where the course leads that is known, by a change of the parameters.
  RotorPhase phase_after(std::size_t i, const Eigen::VectorXd& change) const;

  std::span<const Record> records_;
  const Model& model_;
  const CalibrationOptions& options_;
  FreeParameters free_;
  std::vector<std::vector<std::size_t>> moved_;
  double shortest_piece_;  // [s]
  std::vector<std::pair<Eigen::Index, Prior>> priors_;
  mutable Followed followed_;
};

}  // namespace emtb
