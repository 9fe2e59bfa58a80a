#pragma once

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

}  // namespace emtb
