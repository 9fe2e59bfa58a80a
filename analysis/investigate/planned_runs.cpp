#include "analysis/investigate/planned_runs.h"

#include <algorithm>
#include <limits>

namespace emtb {

double PlannedRuns::seconds() const {
  double total = 0;
  for (const auto* list : {&train, &held_out}) {
    for (const Profile& p : *list) total += p.duration();
  }
  return total;
}

double PlannedRuns::low() const {
  double lowest = std::numeric_limits<double>::infinity();
  for (const auto* list : {&train, &held_out}) {
    for (const Profile& p : *list) lowest = std::min(lowest, p.min());
  }
  return lowest;
}

double PlannedRuns::high() const {
  double highest = -std::numeric_limits<double>::infinity();
  for (const auto* list : {&train, &held_out}) {
    for (const Profile& p : *list) highest = std::max(highest, p.max());
  }
  return highest;
}

}  // namespace emtb
