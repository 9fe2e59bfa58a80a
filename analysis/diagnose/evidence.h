#pragma once

#include <map>
#include <vector>

#include "analysis/diagnose/hypotheses.h"
#include "analysis/diagnose/null_fit.h"
#include "analysis/diagnose/projection.h"

namespace emtb {

/// What the records say of one hypothesis; of each record by itself where its phase is free.
struct Evidence {
  std::map<Signal, CrossSums> plain;
  CrossSums white;

  CrossSums all() const {
    CrossSums sum = white;
    sum.sc.setZero();
    sum.cc.setZero();
    sum.cr.setZero();
    for (const auto& [signal, cross] : plain) sum += cross;
    return sum;
  }
  Evidence& operator+=(const Evidence& b) {
    for (const auto& [signal, cross] : b.plain) {
      auto& own = plain.try_emplace(signal, cross.sc.rows(), cross.sc.cols()).first->second;
      own += cross;
    }
    white += b.white;
    return *this;
  }
};

/// Hypotheses that share a simulation: the same effects may be in it several times, all of them null.
using Batch = std::vector<Hypothesis>;

std::vector<Batch> batches_of(const std::vector<Hypothesis>& hypotheses);

/// What one record says of each hypothesis of a batch, by pieces where the angle wanders under one that repeats.
/// @throws ModelError where a formula is not finite in the record
std::vector<std::vector<Evidence>> evidence_of(const NullFit& fitted, std::size_t index, const Batch& batch);

}  // namespace emtb
