#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tests/blind/answer.h"
#include "tests/blind/wide/case_files.h"

namespace emtb::blind::wide {

/// A case and what was said of it: one line of JSON. Facts only; what is right is decided when they are counted.
struct WideAnswer {
  // The case
  std::string id, kind;
  std::uint64_t seed = 0, checksum = 0;
  std::map<std::string, std::string> traits;
  std::vector<std::string> truth;
  std::vector<double> size;
  std::vector<std::vector<std::string>> right;
  std::vector<std::string> tolerated, lacking;
  double visible = 0;

  // What was said
  std::string verdict;  ///< or `failed: ...`, `not made: ...`
  std::vector<Answer::Named> missing;
  double base = 0, unexplained = 0;
  double seconds = 0;
  std::vector<Covered> intervals, base_intervals;  ///< those that are pinned or without an error are left out
  std::map<std::string, double> secret;            ///< error on runs that nobody handed out, true sigma

  // The oracle; asked where an answer is not right
  std::optional<double> nats;
  double truth_error = 0;
  std::string rival, why_not;

  // What `emtb check` found: `what signal`; nothing where the command is absent
  std::optional<std::vector<std::string>> findings;
  std::string garbage;  ///< `what` that was planted
  std::string garbage_how;
  bool contradicted = false, stopped = false;
};

std::string to_json_line(const WideAnswer& answer);
/// @throws Error where the line is no answer.
WideAnswer wide_answer_from(const std::string& line);

/// What the names are worth, see docs/blind.md.
Grade grade(const WideAnswer& answer);

/// Whether a case counts at all: it was made, it was answered, and the library has what it is about.
bool counts(const WideAnswer& answer);

/// An answer that is not right, though the oracle could tell; for a single, pair or triple.
bool missed(const WideAnswer& answer);
/// Not right, and nothing could tell the truth from what was named. Not where the true structure itself is far from the
/// instruments although the plant obeys the library's laws: then it is the library that cannot tell.
bool undecidable(const WideAnswer& answer);

/// The remainder is stated: `unknown_effect`, or an error above 1.25 floors.
bool states_remainder(const WideAnswer& answer);

/// Findings of `emtb check` that say that something is wrong with data, where nothing is.
std::vector<std::string> false_findings(const WideAnswer& answer);

}  // namespace emtb::blind::wide
