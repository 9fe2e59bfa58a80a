#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "analysis/fit/residuals.h"
#include "analysis/fit/rotor_phase.h"
#include "analysis/record/record.h"

namespace emtb {

/// A combination of parameters that these data do not determine.
struct Undetermined {
  std::string combination;    ///< `R_a`, or `0.7 K_b + 0.7 K_m` in relative changes
  double relative_error = 0;  ///< standard error of the combination, relative to the parameters' own size
};

/// How well data determine the parameters, from the singular values of the sensitivities scaled by the parameters'
/// sizes.
struct Identifiability {
  Eigen::VectorXd singular_values;  ///< of S diag(size); descending
  std::vector<Undetermined> undetermined;
};

/// A fitted model, and all that a further fit of the same records can start from.
struct Fit {
  Model model;      ///< the given one with fitted values
  double cost = 0;  ///< half the sum of squares of the residuals (and priors)
  std::vector<std::string> at_bound =
      {};                   ///< parameters that rest on a bound; known where standard errors were asked for
  RotorPhases phases = {};  ///< of the records, as the fit followed them
};

/// A fit, and what the data tell of it.
struct Calibration : Fit {
  bool converged = false;
  int iterations = 0;
  Eigen::MatrixXd covariance;  ///< of the free parameters; holds for coloured residuals (jackknife over blocks)
  Eigen::VectorXd inflation;   ///< of each free parameter: its variance over that of white residuals; 0: not seen
  Eigen::VectorXd alone;       ///< [SI] standard error of each, were the residuals white and all others known
  Identifiability identifiability;
};

struct CalibrationOptions {
  int extra_starts = 4;  ///< besides the given one; drawn within the bounds, the same on every machine
  int max_iterations = 60;
  double tolerance = 1e-9;  ///< of the cost, relative: where a descent ends
  bool with_covariance = true;
  std::vector<Signal> outputs = {};  ///< compare these alone; empty: all
  RotorPhases phases = {};    ///< of the records, where they are known: followed, not searched; for no extra starts
  bool quick_errors = false;  ///< leaves long blocks and the length of steps out of the standard errors
};

/// The shorter records, up to a quarter of the samples, at least two where there are: for a first look. Two or fewer
/// are those that were given, not copies.
class ShortestRecords {
 public:
  explicit ShortestRecords(std::span<const Record> records);
  ShortestRecords(const ShortestRecords&) = delete;
  ShortestRecords& operator=(const ShortestRecords&) = delete;

  std::span<const Record> all() const { return part_; }

  /// Theirs, of what is known of each record; empty where nothing is.
  RotorPhases of(const RotorPhases& known) const;

 private:
  std::vector<Record> copies_;
  std::vector<std::size_t> places_;  ///< of the copies, among the records
  std::span<const Record> part_;
};

/// Fits the free parameters by output error: bounded nonlinear least squares (descend(): Levenberg and Marquardt) on
/// the weighed residuals of all records, from several starts. A parameter that rests on a bound and would leave it is
/// held there while the others go on; a start that leads back to a valley already known is not followed to its end.
///
/// A step is made of the normal equations SᵀS and Sᵀr, which are summed while the records are simulated, in place of
/// the 10^5 rows they stand for. That squares the condition of S: a direction 10^7 times weaker than the strongest is
/// lost in rounding and is reported as not determined. Standard errors are those of the jackknife: how
/// far the optimum moves where a block of the data is left out, to first order. That holds where residuals are
/// correlated within a block, and counts that few blocks may tell a parameter (Bell and McCaffrey 2002). The largest of
/// blocks of a hundred-and-twenty-eighth of the data to an eighth stands, times Student's quantile for their number
/// over the normal one; never less than the white-noise error, with what is rounded and stands counted once. By how
/// much the length of the simulation's steps moves a parameter, as half the length tells, is added to them.
/// @throws ModelError where there is nothing to fit, or a simulation is not finite.
Calibration calibrate(std::span<const Record> records, const Model& model, const CalibrationOptions& options = {});

/// The same, where a search only wants the best: at infinite cost where nothing can be simulated from the start.
Fit fit_or_none(std::span<const Record> records, const Model& start, CalibrationOptions options);

}  // namespace emtb
