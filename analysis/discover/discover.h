#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "analysis/discover/changed_runs.h"
#include "analysis/discover/disturbances.h"
#include "analysis/discover/law.h"
#include "analysis/discover/missing_torque.h"
#include "analysis/discover/shares.h"
#include "model/model.h"
#include "session/session.h"

namespace emtb {

/// What a model leaves of runs before disturbances were cut from them.
struct WithDisturbances {
  double train = 0, held_out = 0;  ///< error, in noise floors
  std::optional<Law> law;
};

/// What is left after the library, and what can be said of it.
struct Discovery {
  Model fitted;                     ///< the model as given, fitted to the training runs
  double train = 0, held_out = 0;   ///< its error, in noise floors
  bool worth_a_name = false;        ///< something is left that should have one; else nothing is searched
  bool judged_on_training = false;  ///< a single run: nothing could be held out, and no law is offered
  std::map<Signal, double> rmse;    ///< of each signal, SI, on held-out runs
  WhatIsLeft left;                  ///< of the training runs
  Shares torque, voltage;
  std::optional<Law> law;
  std::size_t confirmed_by = 0;                       ///< runs that neither choice nor fit saw
  std::vector<Changed> changed;                       ///< of all runs, those that judge among them
  std::vector<Disturbance> disturbances;              ///< of all runs; all above is without them
  std::optional<WithDisturbances> with_disturbances;  ///< what the runs say as they are, where there is one
  std::vector<Run> train_runs, held_out_runs;         ///< without the disturbances
};

struct DiscoverOptions {
  ReadFormula read;                                                      ///< must be there
  std::function<void(double share, const std::string& doing)> progress;  ///< may be empty
};

/// Fits a model, and looks for a law in what it leaves, for runs of another machine and for disturbances.
///
/// Where two held-out runs or more are named, the shortest of them confirms: neither the choice nor the fit sees it. A
/// law is offered only where the remainder comes again, however little of the motion it is (diagnose/remainder.h), a
/// smooth function of the measured states explains a fifth of it on runs left out, and the library's own criterion
/// calls the law material and determined.
///
/// Disturbances are searched in all runs first. Where there are any, the runs are cut there, and all else is asked of
/// what remains; the answer of the runs as they are stands beside it. Whether it is the same machine is asked of all
/// runs at the end, those that judge among them, in the order in which they are given.
/// @throws ModelError where the runs do not fit the model.
Discovery discover(std::span<const Run> train, std::span<const Run> held_out, const Model& model,
                   const DiscoverOptions& options);

}  // namespace emtb
