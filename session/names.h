#pragma once

#include <set>
#include <string>
#include <vector>

#include "session/session.h"

namespace emtb {

/// Names under which the runs of one file can be told apart: each run's own where it has one, made unique by a number.
inline std::vector<std::string> distinct_names(const std::vector<Run>& runs) {
  std::vector<std::string> names;
  std::set<std::string> taken;
  for (const Run& run : runs) {
    const std::string base = run.name.empty() ? "run" : run.name;
    std::string name = base;
    for (int n = 2; !taken.insert(name).second; ++n) name = base + "_" + std::to_string(n);
    names.push_back(name);
  }
  return names;
}

}  // namespace emtb
