#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analysis/diagnose/next_experiment.h"
#include "analysis/discover/law.h"

namespace emtb {

/// Runs that would show a law where its curve is least sure, or where its rivals part: one to fit to, and one that goes
/// the same ways in the other order, to judge by.
struct LawExperiment {
  std::string formula;     ///< of the law, in words
  std::string over;        ///< the quantity of its curve
  std::vector<double> at;  ///< places of it that the runs hold [its unit]
  Profile fit, judge;
};

/// Holds the reference where the model with the law comes to rest at each of the law's unsure places, and a little
/// below and above.
/// @param hold [s] of each level @return none where the law is over the angle or the time, or the bench reaches no such
/// place
std::optional<LawExperiment> law_experiment(const Law& law, const Reach& reach, double hold);

}  // namespace emtb
