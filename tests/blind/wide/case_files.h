#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tests/blind/wide/wide_case.h"

namespace emtb::blind::wide {

/// A case as a user has it: a file a run, and a model file whose start values are loose. `secret` holds runs that
/// nobody hands to the tool, `truth.json` what is hidden.
struct CaseFiles {
  std::filesystem::path folder;
  std::string model = "model.yaml";  ///< in the folder, as all of these
  std::vector<std::string> train, held_out, secret;
  std::uint64_t checksum = 0;  ///< of the model and the sessions that are CSV: the same on every machine

  /// MODEL SESSION... --held-out SESSION...
  std::vector<std::string> arguments() const;
};

/// Writes them all. @throws Error where the folder cannot be written.
CaseFiles write_case(const WideCase& c, const std::filesystem::path& folder);

/// The model file's text.
std::string model_text(const WideCase& c);

/// The true value of each base parameter.
std::vector<std::pair<std::string, double>> true_base(const WideCase& c);

/// What is hidden, as JSON.
std::string truth_text(const WideCase& c);

}  // namespace emtb::blind::wide
