#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "analysis/record/record.h"
#include "hal/processor.h"

namespace emtb {

/// What a descent needs of one record: sums over the readings of all its wanted observations, of the residuals
/// r = (measured - simulated)/sigma and of their sensitivities s = d(simulated)/dp/sigma.
struct PassSums {
  static constexpr std::size_t most = 24;  ///< parameters

  std::array<double, most * most> sts{};  ///< sum of s sᵀ, most numbers a row
  std::array<double, most> str{};         ///< sum of s r
  double rtr = 0;                         ///< sum of r²
};

/// Simulates a record once and sums while it goes: the residuals and their sensitivities, megabytes of them, are never
/// kept.
/// @param values all parameters, in the order of the structure
/// @param moved  for each of up to PassSums::most parameters, the places in `values` that it moves
/// @param wanted for each observation of the record whether it counts
PassSums summed_pass(const Record& record, const ModelStructure& structure, std::span<const double> values,
                     std::span<const std::vector<std::size_t>> moved, const std::vector<char>& wanted);

/// As compiled for one processor.
template <Processor>
PassSums summed_pass_for(const Record& record, const ModelStructure& structure, std::span<const double> values,
                         std::span<const std::vector<std::size_t>> moved, const std::vector<char>& wanted);
template <>
PassSums summed_pass_for<Processor::any>(const Record& record, const ModelStructure& structure,
                                         std::span<const double> values,
                                         std::span<const std::vector<std::size_t>> moved,
                                         const std::vector<char>& wanted);
template <>
PassSums summed_pass_for<Processor::avx2>(const Record& record, const ModelStructure& structure,
                                          std::span<const double> values,
                                          std::span<const std::vector<std::size_t>> moved,
                                          const std::vector<char>& wanted);

}  // namespace emtb
