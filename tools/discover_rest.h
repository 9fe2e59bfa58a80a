#pragma once

#include <memory>
#include <span>

#include "analysis/diagnose/diagnose.h"
#include "analysis/discover/discover.h"
#include "config/formula_effect.h"
#include "hal/error.h"

namespace emtb {

/// A law's formula as the reader of `--candidates` has it.
inline AddedTerm read_law(const FormulaText& text) {
  return read_formula(YamlMap::parse(text.yaml(), "a law"), text.id);
}

/// What is left of a diagnosis that ends with something that no effect of the library explains; null otherwise.
inline std::unique_ptr<Discovery> discover_rest(const Diagnosis& d, std::span<const Run> train,
                                                std::span<const Run> held_out) {
  if (d.verdict != Verdict::unknown_effect) return nullptr;
  DiscoverOptions options;
  options.read = read_law;
  try {
    return std::make_unique<Discovery>(discover(train, held_out, d.final, options));
  } catch (const ModelError&) {
    return nullptr;  // the verdict stands without it
  }
}

}  // namespace emtb
