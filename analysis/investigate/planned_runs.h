#pragma once

#include <optional>
#include <vector>

#include "analysis/diagnose/next_experiment.h"
#include "analysis/discover/law_experiment.h"
#include "experiment/profile.h"

namespace emtb {

/// Runs that an investigation wants, and why.
struct PlannedRuns {
  enum class Why {
    no_sessions,    ///< nothing is recorded yet
    undecided,      ///< what was recorded elsewhere leaves the verdict open
    unnamed,        ///< what is left after these first runs has no name: longer runs, of more kinds
    unsure_law,     ///< what is left has a law, whose curve is not sure everywhere
    tied,           ///< several effects do as well: the experiment that separates them best
    to_be_foretold  ///< the model found foretells a run that nobody has seen
  };

  Why why = Why::no_sessions;
  std::vector<Profile> train, held_out;  ///< to fit to, and to judge by
  std::optional<Proposal> proposal;      ///< of Why::tied: what the runs are to separate
  std::optional<LawExperiment> law;      ///< of Why::unsure_law: where they are to show it

  std::size_t count() const { return train.size() + held_out.size(); }
  double seconds() const;  ///< [s] that all of them take
  double low() const;      ///< [V] the lowest reference
  double high() const;     ///< [V] the highest
};

}  // namespace emtb
