#pragma once

#include <cmath>
#include <cstdint>

#include "analysis/discover/discover.h"
#include "config/formula_effect.h"
#include "tests/blind/recording.h"

namespace emtb {

inline AddedTerm read(const FormulaText& text) { return read_formula(YamlMap::parse(text.yaml(), "a law"), text.id); }

/// What is said of the bench's own runs.
inline Discovery discover_on(const blind::Bench& bench, std::uint64_t seed = 1) {
  return discover(record(bench, bench.train, seed), record(bench, bench.held_out, 100 + seed), bench.model,
                  {.read = read, .progress = {}});
}

/// A friction that rises, falls and rises again: no formula of three parameters does.
inline double friction_of_two_humps(double omega) {
  const double size = std::abs(omega), first = (size - 110) / 45, second = (size - 300) / 60;
  return std::copysign(0.02 * std::exp(-first * first) + 0.03 * std::exp(-second * second), omega);
}

}  // namespace emtb
