#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "analysis/diagnose/trials.h"

namespace emtb {

/// What was tried of one absent effect.
struct Candidate {
  Score score;                           ///< at the model where it was last scored
  std::optional<double> held_out_error;  ///< of the best refit that included it
  std::string implausible = {};          ///< why it was refused though it explains something; empty: it was not
};

/// A step of a search, as it is told.
struct Step {
  std::string action;                ///< `added coulomb_friction`
  std::optional<std::size_t> added;  ///< the effect, where one was
  double train = 0;
  double held_out = 0;
};

/// A model that does as well, or nearly so, with another effect in the place of a member.
struct Rival {
  std::size_t effect = 0;
  Model model;
};

/// What a search found: a model, and how it came about.
struct Finding {
  Trial current;
  std::vector<std::size_t> effects;                    ///< in the order found
  std::map<std::size_t, Loss> before;                  ///< each effect was added
  std::map<std::size_t, std::vector<Rival>> rivals;    ///< of each member
  std::map<std::size_t, std::vector<Rival>> near;      ///< of each that says how late edges come: what does not do as
                                                       ///< well, but comes near, in the order tried
  std::map<std::size_t, std::vector<Addition>> alike;  ///< of each: what did as well when it was added
  std::vector<Candidate> candidates;                   ///< in the order tried
  std::vector<Step> steps;

  /// The steps, and where it ended, if that is not where the last step did: timing, starts and floors were told anew.
  std::vector<Step> steps_to_the_end() const;

  /// An effect more. @param with the model with it
  void add(std::size_t effect, Trial with);

  /// Another effect in the place of one of them, which goes. @param with the model with it
  void swap(std::size_t place, std::size_t effect, Trial with);
};

}  // namespace emtb
