#pragma once

#include <limits>
#include <span>
#include <string>
#include <vector>

#include "analysis/diagnose/compare.h"
#include "analysis/diagnose/foresee.h"
#include "experiment/profile.h"
#include "model/model.h"

namespace emtb {

/// An experiment of the menu, and how far apart it would bring two models that these data cannot tell from each other.
struct Proposal {
  Profile profile;
  std::string what;            ///< how to run it, for people
  std::vector<Signal> record;  ///< signals to record that these data lack
  double separation = 0;       ///< see next_experiments()
};

/// What a bench allows. As it stands: as far as the data went, however long it takes.
struct Reach {
  double low = 0, high = 0;                                  ///< [V] references that may be set besides
  double longest = std::numeric_limits<double>::infinity();  ///< [s] a run may take
  SignalLimits limits{};                                     ///< no experiment is to come near them
};

/// The menu, best first: staircase, ramp, coast-down, reversal, small steps, a random sequence, a heat soak; each as
/// the data were recorded and with a fast current or the armature voltage beside, where they lack it. References stay
/// within what the data have already shown to be safe, or what the bench is said to allow; levels become smaller where
/// the one model foresees that signals would come near the bench's limits.
///
/// Each is simulated with the one model and predicted by each of the others, whose parameters first adapt as far as the
/// data at hand and the new run together let them (a Gauss-Newton step). What is left, as root mean square in multiples
/// of the floor, of the signal that shows it best, is the separation; the least of all others counts. After
/// Buzzi-Ferraris and Forzatti (1983): the difference of two predictions, weighed against what parameters leave
/// uncertain.
/// @param runs as recorded: their instruments, rates and ranges are those of the experiment
/// @param noise of the signals in them; for a signal that they lack, a thousandth of its range is assumed
std::vector<Proposal> next_experiments(std::span<const Run> runs, const Dataset& data, const Model& one,
                                       std::span<const Model> others, const Reach& reach = {});

/// The menu but for the heat soak, for where a remainder has no name yet: longer runs, of more kinds than
/// first_experiments(), as far as the bench allows and the model foresees that it keeps away from the limits. The
/// staircase comes last, to judge by.
std::vector<Profile> broader_experiments(const Model& model, const Reach& reach);

/// A separation that an experiment should promise before anybody runs it.
inline constexpr double worth_an_experiment = 0.3;

/// The best of the menu in a sentence, or that none of it can tell the effects apart.
std::string in_words(const Proposal& best);

}  // namespace emtb
