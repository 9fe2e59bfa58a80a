#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "analysis/diagnose/diagnose.h"
#include "model/catalogue.h"
#include "tests/blind/recording.h"

/// What a diagnosis answers, in the terms of a test.
namespace emtb::answers {

inline std::vector<std::string> named(const Diagnosis& d) {
  std::vector<std::string> ids;
  for (const MissingEffect& m : d.missing) ids.emplace_back(effect_catalogue()[m.effect].id);
  return ids;
}

/// The effect and all that are tied with it.
inline std::vector<std::string> named_or_tied(const Diagnosis& d) {
  std::vector<std::string> ids = named(d);
  for (const MissingEffect& m : d.missing) {
    for (const std::size_t rival : m.tied_with) ids.emplace_back(effect_catalogue()[rival].id);
  }
  return ids;
}

inline double fitted(const Diagnosis& d, const std::string& symbol) {
  for (const MissingEffect& m : d.missing) {
    for (const Parameter& p : m.parameters) {
      if (p.symbol == symbol) return p.value;
    }
  }
  return std::nan("");
}

inline std::string report(const Diagnosis& d) {
  std::string text = std::string(word(d.verdict)) + ", held-out " + std::to_string(d.base_held_out) + " -> " +
                     std::to_string(d.final_held_out) + ":";
  for (const std::string& id : named_or_tied(d)) text += " " + id;
  for (const Step& s : d.steps) text += "\n  " + s.action + ": held-out " + std::to_string(s.held_out);
  for (const auto& [signal, fit] : d.signals) {
    text += "\n  " + std::string(info(signal).name) + " " + std::to_string(fit.ratio) + " floors";
  }
  for (const Candidate& c : d.candidates) {
    text += "\n  " + std::string(effect_catalogue()[c.score.effect].id) + " drop " +
            std::to_string(c.score.predicted_drop) + " p " + std::to_string(c.score.p_value) + " held-out " +
            std::to_string(c.held_out_error.value_or(-1));
  }
  return text;
}

inline Diagnosis diagnose_on(const blind::Bench& bench, std::uint64_t seed = 1) {
  return diagnose(record(bench, bench.train, seed), record(bench, bench.held_out, seed + 100), bench.model);
}

}  // namespace emtb::answers
