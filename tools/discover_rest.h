#pragma once

#include <memory>
#include <span>
#include <tuple>

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
    auto rest = std::make_unique<Discovery>(discover(train, held_out, d.final, options));
    if (!rest->with_disturbances) {  // of the same model on the same runs: one number, which the last digits of a
                                     // second fit do not change
      rest->train = d.final_train;
      rest->held_out = d.final_held_out;
      if (rest->law)
        std::tie(rest->law->train_before, rest->law->held_out_before) = std::tie(d.final_train, d.final_held_out);
    }
    return rest;
  } catch (const ModelError&) {
    return nullptr;  // the verdict stands without it
  }
}

}  // namespace emtb
