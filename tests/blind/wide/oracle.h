#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tests/blind/wide/case_files.h"

namespace emtb::blind::wide {

/// Could these data tell the truth from what was named? Asked of the true structure, which is fitted to the training
/// runs from the true values and compared on runs that no fit has seen (those held out and the secret ones).
struct Oracle {
  /// By how much ln L of the true structure is above that of the best wrong set of at most its size that can be made
  /// of what was named: sum over signals of n_eff/2 ln(MSE_wrong/MSE_true). At least 3: the case is decidable.
  std::optional<double> nats;
  std::string rival;       ///< that set
  double truth_error = 0;  ///< RMSE of the true structure on those runs, true sigma, of the worst signal
  std::string why_not;     ///< no answer: the library lacks an effect, or a fit failed
  bool decidable() const { return !nats || *nats >= 3; }
};

/// @param named ids that the diagnosis named; empty: the base model is the rival
Oracle ask_oracle(const WideCase& c, const CaseFiles& files, const std::vector<std::string>& named);

/// Error of a model file as it stands on the secret runs: RMSE of each signal in units of the instrument's true sigma
/// (a speed that the log does not have: of the speed's floor), by the signal's name.
std::map<std::string, double> secret_errors(const WideCase& c, const CaseFiles& files, const std::string& model);

/// The library knows an effect of this name.
bool in_library(const std::string& id);

}  // namespace emtb::blind::wide
