#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "analysis/discover/law.h"

namespace emtb::blind {

/// RMS of the found curve less the hidden one over the hidden span. @param aside a straight line through zero is B's
inline double curve_error(const Law& law, const std::string& over, const std::function<double(double)>& truth,
                          bool aside) {
  if (law.text.of.front() != over || law.text.place != TermPlace::torque) return 1;
  double xy = 0, xx = 0, low = 0, high = 0;
  std::vector<double> off;
  for (std::size_t k = 0; k < law.at.size(); ++k) {
    const double v = truth(law.at[k]);
    off.push_back(law.value[k] - v);
    xy += law.at[k] * off.back();
    xx += law.at[k] * law.at[k];
    low = std::min(low, v);
    high = std::max(high, v);
  }
  double squares = 0;
  for (std::size_t k = 0; k < off.size(); ++k) squares += std::pow(off[k] - (aside ? xy / xx * law.at[k] : 0), 2);
  return std::sqrt(squares / static_cast<double>(off.size())) / (high - low);
}

}  // namespace emtb::blind
