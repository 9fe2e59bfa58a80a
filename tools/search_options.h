#pragma once

#include <string>

#include "tools/checked.h"
#include "tools/command_line.h"
#include "tools/offered_words.h"

namespace emtb {

inline constexpr const char* candidates_help =
    "a YAML file of formulas of your own, to be tried beside the library's effects";

/// What is searched, and for how long.
inline Command& search_options(Command& command, std::string& candidates, Wanted& wanted, SearchWords& search) {
  return command.option("--candidates", candidates, candidates_help)
      .options("--only", wanted.only, only_help)
      .offers(effect_ids)
      .options("--without", wanted.without, without_help)
      .offers(effect_ids)
      .option("--effort", search.effort, effort_help)
      .option("--explain", search.explain, explain_help)
      .one_of({"torque"});
}

}  // namespace emtb
