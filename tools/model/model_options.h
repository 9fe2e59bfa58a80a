#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analysis/fit/calibrate.h"
#include "model/model.h"
#include "session/session.h"
#include "tools/kept/kept_answers.h"
#include "tools/offered_words.h"

namespace emtb {

/// Runs that a model is fitted to, and those that judge, without a gap in what drives it.
struct CheckedRuns {
  std::vector<Run> train, held_out;
};

/// What the commands on a model and sessions are told.
struct ModelOptions {
  std::string effect, model;
  std::vector<std::string> sessions, held_out, outputs;
  std::string map, out, json_file, candidates;
  Wanted wanted;
  SearchWords search;
  bool fit = false, plot = false, every_candidate = false, intervals = false, unchecked = false;

  std::vector<Run> runs(const std::vector<std::string>& specs) const;

  KeptAnswers::Files files() const;

  /// Those that fit and those that judge; nothing where a finding stops it.
  std::optional<CheckedRuns> checked_runs(const Model& m) const;

  /// The model, with the formulas of the user that it may be given.
  Model model_with_candidates() const;

  /// @throws Error where a signal of --outputs is none
  CalibrationOptions calibration() const;

  /// Writes what a command made of the model, where it was asked to.
  void finish_model(const Model& made) const;
};

int calibrate_command(const ModelOptions& o);
int add_command(const ModelOptions& o);
int compare_command(const ModelOptions& o);
int diagnose_command(const ModelOptions& o);

}  // namespace emtb
