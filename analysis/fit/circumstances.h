#pragma once

#include <vector>

#include "analysis/record/dataset.h"

namespace emtb {

/// How the runs were logged and begin, as it is set.
struct Circumstances {
  Timing timing;
  std::vector<InitialState> starts;
};

/// How they are set in some data.
Circumstances circumstances_of(const Dataset& data);

/// Sets them in data of the same runs.
void set(Dataset& data, const Circumstances& circumstances);

}  // namespace emtb
