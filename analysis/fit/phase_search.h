#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "analysis/fit/phase_knots.h"
#include "analysis/fit/rotor_phase.h"
#include "analysis/record/record.h"
#include "model/structure.h"

namespace emtb {

/// An effect of a structure that repeats with the angle.
struct PeriodicPart {
  std::size_t index = 0;  ///< among the structure's effects
  std::size_t place = 0;  ///< of its amplitude among the values; its phase comes last of its parameters
  std::size_t count = 0;  ///< of its parameters
  double order = 1;       ///< how often a turn it repeats
};

std::vector<PeriodicPart> periodic_parts(const ModelStructure& structure, std::span<const double> values);

/// What waves of unit amplitude, in phase and a quarter of a period later, would do to a record in which nothing
/// repeats with the angle, to first order: with these, the cost at any phase is a quadratic form of its sines and
/// cosines, from knot to knot, and no phase needs a simulation of its own.
class WavesOfPhase {
 public:
  WavesOfPhase(const Record& record, const ModelStructure& structure, std::span<const double> values,
               std::span<const PeriodicPart> parts, const Knots& knots);

  std::size_t pieces() const { return pieces_.size(); }

  /// The cost of what is read between a knot and the next, less that without any wave.
  double cost(std::size_t piece, double phase) const;

 private:
  struct Piece {
    Eigen::MatrixXd information;
    Eigen::VectorXd gradient;
  };

  /// How many values the parts before the k-th have been doubled by.
  std::size_t shift(std::size_t k) const {
    std::size_t sum = 0;
    for (std::size_t i = 0; i < k; ++i) sum += parts_[i].count;
    return sum;
  }

  std::vector<PeriodicPart> parts_;
  std::vector<double> amplitudes_;
  std::vector<Piece> pieces_;
};

/// The phases that are likely by the waves, at most a few, the best first: the cheapest path over a grid of phases from
/// knot to knot (Viterbi), to each valley at the end.
/// @param steps of the grid in the period of the slowest @param stiffer than the wander of the angle asks for
std::vector<RotorPhase> likely_phases(const WavesOfPhase& waves, const Knots& knots, double period, int steps,
                                      double stiffer);

}  // namespace emtb
