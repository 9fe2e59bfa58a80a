#pragma once

#include <span>
#include <vector>

#include "analysis/record/record.h"
#include "model/model.h"

namespace emtb {

/// The score test: which absent effect would explain the residuals, judged at zero amplitude without refitting.
///
/// Let r be the residuals of the fitted model and S their sensitivities to the fitted parameters, all divided by sigma.
/// An absent effect with parameters a has sensitivities C at its null value. What the fitted parameters could imitate
/// of it is projected off, C' = C - S (SᵀS)⁻¹ SᵀC; the rest is what only this effect can do:
///
///     a = (C'ᵀC')⁻¹ C'ᵀr            expected value: what a refit would find, to first order
///     drop = aᵀ C'ᵀ r               predicted drop of the sum of squares
///     visibility = |C'| / |C|       0: an exact alias of the fitted parameters in these data
///
/// An amplitude that cannot be negative scores nothing on the wrong side. Shapes are tried on a grid that the data's
/// own ranges span, orders of the shaft are read off the residuals' spectrum over the angle, and an effect that has no
/// null but fades (a saturation, a heat capacity) is tried as it stands: C is then the whole change that it makes, and
/// a = 1. Significance (Lagrange multiplier test on residuals and sensitivities whitened by a first-order
/// autoregression per record and signal) is a gate only: with 10^5 readings every wrong model is significant. Sources:
/// Davidson and MacKinnon (1993), ch. 6 (Gauss-Newton regression); Saris, Satorra and van der Veld (2009).
struct Score {
  /// A way from the fitted model to the one with the effect; values in the order of the effect's parameters, SI.
  struct Start {
    std::vector<double> from;      ///< where the effect was scored
    std::vector<double> expected;  ///< what a refit would find, to first order
    std::vector<double> others;    ///< by how much the fitted parameters then change; empty: not at all
  };

  std::size_t effect = 0;     ///< as the model numbers them: of the catalogue, then the formulas on offer
  std::vector<Start> starts;  ///< the best, and for an effect that fades and has a shape, or repeats with the angle,
                              ///< where else it was tried
  double predicted_drop = 0;  ///< of the sum of squares in units of sigma^2
  double predicted_nats = 0;  ///< gain of the logarithm of the likelihood, see likelihood.h: this ranks. A sum of
                              ///< squares is that of the signal furthest above its floor alone
  double predicted_gain = 0;  ///< largest mean square, in units of sigma^2, that goes from a signal
  double visibility = 0;
  double p_value = 1;
  double detectable_size = 0;  ///< of the first parameter: found with power 0.8; infinite where it cannot be seen, or
                               ///< for one that fades, 0

  const std::vector<double>& expected() const { return starts.front().expected; }
};

struct ScoreOptions {
  double false_alarms = 0.05;       ///< over the whole list of candidates
  double material_least = 0.10;     ///< mean square that an effect must remove to count
  double gain_worth_a_refit = 0.5;  ///< mean square whose promise needs no test of significance
  bool whole_orders = false;        ///< what repeats with the angle: at all whole orders, not at those of the spectrum
};

/// Scores each candidate on the records, at the values of the fitted model.
/// @throws ModelError where a formula is not finite in a record.
std::vector<Score> score(std::span<const Record> records, const Model& fitted, std::span<const std::size_t> candidates,
                         const ScoreOptions& options = {});

/// Those that pass the gate (Holm's step-down over all scores), or promise much, and could matter, largest predicted
/// drop first.
std::vector<Score> promising(std::vector<Score> scores, const ScoreOptions& options = {});

}  // namespace emtb
