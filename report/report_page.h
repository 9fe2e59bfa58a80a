#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "analysis/diagnose/diagnose.h"
#include "config/mapping.h"
#include "report/page.h"
#include "session/session.h"
#include "report/investigation_story.h"

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
  std::optional<InvestigationStory> story;  ///< where the bench itself made the runs

  /// Adds the runs of a session, as it is named on the command line.
  void add(const std::string& spec, bool as_held_out, const Mapping& mapping = {});
  std::vector<Run> part(bool held_out) const;
};

/// The whole report of a diagnosis.
Page report_page(const ReportInput& input, const Diagnosis& diagnosis);

/// The report where the analysis refused: why, what is lacking, and the recordings as they are.
Page refusal_page(const ReportInput& input, const std::string& why);

/// @param option that named the file
/// @throws Error where it cannot be written.
void write_page(const std::string& file, const Page& page, const std::string& option = "--out");

/// The verdict in a sentence or two, with numbers.
std::string verdict_in_words(const Diagnosis& diagnosis);

}  // namespace emtb
