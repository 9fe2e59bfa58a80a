#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "tests/blind/wide/logger.h"

namespace emtb::blind::wide {

/// How much of what is hidden shows in the readings: what no change of R_a, K_b, B, J (and of the friction or fan that
/// the model has) could imitate. Found with the plant alone, never with the library's equations: the change of the
/// ideal readings, less its best approximation by the plant's own sensitivities.
class Visibility {
 public:
  /// @param bench with nothing hidden
  Visibility(const WideBench& bench, std::uint64_t seed);

  /// 1: just material, for the signal that shows it best. Material is an rms of 5 floors of the instrument, of twice
  /// what the model error of the bench's own does, and of 3 % of what the signal moves.
  /// @param hidden the bench with something in it; @param without what it is compared with
  double of(const WideBench& hidden) const { return of(hidden, base_); }
  double of(const WideBench& hidden, const WideBench& without) const;

 private:
  using Readings = std::map<Signal, std::vector<double>>;  ///< of all runs, one after another

  Readings ideal(const WideBench& bench) const;
  /// What is left of a change when the sensitivities have taken what they can, rms of each signal.
  std::map<Signal, double> unexplained(const Readings& with, const Readings& without) const;

  WideBench base_;
  std::uint64_t seed_;
  std::vector<std::vector<double>> written_;  ///< of each run: the same for all benches, so that no loop answers
  Readings plain_;
  std::vector<Readings> sensitivities_;
  std::map<Signal, double> sigma_, moves_, model_error_;
};

}  // namespace emtb::blind::wide
