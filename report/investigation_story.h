#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "analysis/diagnose/diagnose.h"
#include "report/page.h"
#include "session/session.h"

namespace emtb {

/// How an investigation came to what it found, for its page.
struct InvestigationStory {
  /// One diagnosis, and what was run after it.
  struct Round {
    std::size_t sessions = 0;    ///< that were fitted to
    double base = 0, final = 0;  ///< [noise floors] on held-out runs
    std::string answer;          ///< `tied: coulomb_friction or load_torque`
    std::string then;            ///< what was run next, and why; empty: nothing
  };
  /// A run that was said before it was made.
  struct Foretold {
    std::string prediction, session;  ///< files; the first was written before the second was recorded
    Run run;                          ///< what came
    Model judge;                      ///< says what noise is
    double base = 0, final = 0;       ///< [noise floors] of the given and the found model, from the reference alone
  };
  std::vector<Round> rounds;
  std::optional<Foretold> foretold;
};

/// The verdict of a round with its names, for InvestigationStory::Round::answer.
std::string answer_of(const Diagnosis& diagnosis);

/// Tells it: a table of the rounds, and the prediction over what came.
void tell(Page& page, const InvestigationStory& story, const Diagnosis& diagnosis);

}  // namespace emtb
