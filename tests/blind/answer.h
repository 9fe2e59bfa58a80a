#pragma once

#include <iosfwd>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tests/blind/case.h"

namespace emtb::blind {

/// An estimate beside the truth.
struct Covered {
  std::string name;  ///< `coulomb_friction.T_c`, `R_a`
  double truth = 0, value = 0, std_error = 0;
};

/// A case and what the diagnosis said about it: one line of JSON. Facts only; what counts as right is decided when they
/// are read, so that a rule can change without running anything again.
struct Answer {
  struct Named {
    std::string id;
    std::vector<std::string> tied_with;
  };

  /// What became of a candidate.
  struct Tried {
    std::optional<double> held_out;  ///< error of its best refit; none: the gate or the ranking kept it from one
    double predicted_drop = 0, predicted_gain = 0, visibility = 0, p_value = 1;
  };

  // The case
  std::string id, kind, bench, laws, nuisance;
  std::uint64_t seed = 0;
  std::vector<std::string> truth;               ///< ids
  std::vector<double> size;                     ///< of each
  std::vector<std::vector<std::string>> right;  ///< ids that count as right for each
  std::vector<std::string> tolerated, lacking, given;

  // What was said
  std::string verdict;  ///< or `failed: ...`
  std::vector<Named> missing;
  std::map<std::string, Tried> candidates;  ///< every effect that was scored
  double base = 0, unexplained = 0;         ///< held-out error of the given and the final model, as stated

  // What it was worth
  double floor = 1;                           ///< of a model that lacks nothing, in units of the true sigma
  double linear_error = 0, final_error = 0;   ///< held-out error of the given and the final model, in units of that
  std::map<std::string, double> signals;      ///< RMSE/sigma of each signal in the final model, true sigma
  std::map<std::string, double> sigma_ratio;  ///< of each signal: the floor that the diagnosis used, by the true sigma
  std::vector<Covered> intervals;             ///< of effects that obey the library's law
  std::vector<Covered> base_intervals;        ///< of R_a, K_b, B and J
  double seconds = 0, cpu_seconds = 0;        ///< of the diagnosis
  double making_seconds = 0;                  ///< of drawing, sizing and recording the case
};

/// Diagnoses a case. A diagnosis that throws is an answer, too.
Answer judge(const Case& c);

std::string to_json_line(const Answer& answer);

/// @throws Error where the line is no answer.
Answer answer_from(const std::string& line);

/// What an answer to a case with one or two effects is worth.
struct Grade {
  std::vector<bool> found;         ///< each truth: named, or tied with what was named (at most three in a tie)
  std::vector<bool> alone;         ///< each truth: named first, tied with nothing that is not its alias
  std::vector<std::string> wrong;  ///< named, but neither true nor tolerated
  bool all_right() const;          ///< every truth found, nothing wrong beside
  bool any_found() const;
};
Grade grade(const Answer& answer);

/// Could these data tell the truth from what it was tied with? Not where a rival's refit predicts the held-out runs
/// as well as the truth's own, to 1 %.
bool data_can_tell(const Answer& answer);

}  // namespace emtb::blind
