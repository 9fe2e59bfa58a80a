#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace emtb {

/// Readings that follow each other and have the same value.
struct EqualReadings {
  std::size_t begin = 0, end = 0;  ///< the readings begin ... end - 1
  double value = 0;

  std::size_t length() const { return end - begin; }
};

/// All readings, in stretches as long as they can be.
std::vector<EqualReadings> equal_readings(std::span<const double> x);

}  // namespace emtb
