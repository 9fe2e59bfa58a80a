#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "analysis/diagnose/compare.h"
#include "analysis/diagnose/diagnose.h"
#include "analysis/discover/discover.h"
#include "analysis/investigate/experiment_bench.h"
#include "analysis/investigate/planned_runs.h"
#include "model/model.h"

namespace emtb {

/// What is left of a diagnosis, looked into for a law; null where nothing is, or nothing can be said.
using Discover = std::function<std::unique_ptr<Discovery>(const Diagnosis&, std::span<const Run> train,
                                                          std::span<const Run> held_out)>;

struct InvestigateOptions {
  int rounds = 4;          ///< diagnoses at most
  double settle = 10;      ///< [s] the motor takes to settle, and a slow meter for some readings
  bool foretell = true;    ///< ends with a run that is predicted before it is made
  std::uint64_t seed = 7;  ///< of that run
  Discover discover;       ///< empty: no law is asked for
};

/// One diagnosis, and what was run after it.
struct InvestigationRound {
  struct Named {
    std::string id;
    std::vector<std::string> tied_with;
  };
  Verdict verdict = Verdict::cannot_tell;
  std::vector<Named> missing;
  double base = 0, final = 0;       ///< [noise floors] on held-out runs
  std::size_t sessions = 0;         ///< that were fitted to
  std::optional<PlannedRuns> then;  ///< what was run next; none: nothing
};

/// A run that was said before it was made.
struct ForetoldRun {
  Profile profile;
  std::string prediction;  ///< where it was kept, written before the run was made
  Recording recording;     ///< what came
  Model judge;             ///< says what noise is: that of the diagnosis, for one run may have no settled stretch
  Comparison base, final;  ///< the given model as fitted, and the found one
};

/// What an investigation came to.
struct Investigation {
  std::vector<InvestigationRound> rounds;
  std::optional<Diagnosis> diagnosis;        ///< the last; none: it did not come so far
  std::shared_ptr<const Discovery> rest;     ///< of what it leaves; null: nothing was asked of it
  std::vector<std::string> train, held_out;  ///< the recordings that it is of
  std::optional<ForetoldRun> foretold;
  std::string broken_off;  ///< why it ended before its time: a bench at fault, a stop; empty: it did not

  /// Whether the verdict stands: nothing is tied, nothing is left without a name.
  bool decided() const;
};

/// Told while an investigation goes on. Each may be left as it is.
class InvestigationListener {
 public:
  virtual ~InvestigationListener() = default;

  virtual void diagnosing(double /*share*/, const std::string& /*doing*/) {}
  virtual void diagnosed(int /*round*/, const InvestigationRound&, const Diagnosis&) {}

  /// A run is made with smaller levels, for more would come near a limit of the bench.
  virtual void made_smaller(const Profile&) {}

  /// What the model says of a run that is yet to be made: to be kept from now on.
  /// @return where it is kept
  virtual std::string foretold(const Model& /*model*/, const Profile& /*profile*/) { return {}; }
};

/// Lets a bench find out what a model is missing. Diagnoses; where the verdict is open, effects are tied, or a law
/// of what has no name is not sure, runs what tells more, and diagnoses again, until the verdict stands, nothing that
/// the bench can run would tell more, somebody does not agree, or the rounds are used up. Then predicts a run that is
/// yet to be made, makes it, and compares.
///
/// No run is made without ExperimentBench::agrees(), none that the model foresees to come near a limit, and none after
/// ExperimentBench::stop_wanted().
/// @param train    recordings to begin with; without them six experiments are made first
/// @param held_out those that judge and take no part in a fit
/// @return what was found so far also where an Error of the bench, the model or the listener broke it off.
Investigation investigate(ExperimentBench& bench, const Model& given, std::vector<Recording> train,
                          std::vector<Recording> held_out, const InvestigateOptions& options,
                          InvestigationListener& listener);

}  // namespace emtb
