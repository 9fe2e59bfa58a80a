#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "analysis/discover/discover.h"
#include "analysis/investigate/investigate.h"
#include "config/mapping.h"
#include "model/model.h"
#include "report/page.h"
#include "session/session.h"

namespace emtb {

/// A run of the report.
struct ReportRun {
  std::string spec;  ///< as the command line names its session
  bool held_out = false;
  Run run;                  ///< what was used
  Run whole;                ///< what the file holds of that run
  double from = 0, to = 0;  ///< [s] the span of `whole` that was used
};

/// What a report tells of, besides the diagnosis.
struct ReportInput {
  /// @param given its file's model, and how the command was called
  static ReportInput of(std::string model_file, Model given, std::string command);

  std::string model_file;
  Model model;  ///< as given
  std::vector<ReportRun> runs;
  std::string map_file;         ///< empty: none
  std::string candidates_file;  ///< empty: none
  std::string software;         ///< `emtb 0.1.0, commit abc1234`
  std::string date;
  std::string command;  ///< as it was called
  std::function<void(const NamedFigure&)> on_figure;
  const Investigation* investigation = nullptr;  ///< where the bench itself made the runs: how it came to the diagnosis

  const Discovery* discovery = nullptr;  ///< where something is left that the library does not hold

  /// Adds the runs of a session, as it is named on the command line.
  void add(const std::string& spec, bool as_held_out, const Mapping& mapping = {});
  /// Makes each run pieces without a gap in the model's input.
  void split_at_gaps();
  std::vector<Run> part(bool held_out) const;

  bool every_run_has(Signal signal) const;
  bool some_run_has(Signal signal) const;
};

}  // namespace emtb
