#include "analysis/discover/library_rival.h"

#include <vector>

#include "analysis/diagnose/fitted_trials.h"
#include "analysis/diagnose/loss.h"
#include "analysis/diagnose/moves.h"
#include "analysis/diagnose/refit.h"
#include "analysis/diagnose/score.h"
#include "analysis/diagnose/told_from_nothing.h"
#include "analysis/fit/residuals.h"
#include "analysis/fit/rotor_phase.h"
#include "analysis/numerics/parallel.h"

namespace emtb {

std::optional<LibraryRival> best_of_library(std::span<const Record> records, const Model& fitted,
                                            const Quality& quality) {
  constexpr std::size_t most = 4;
  constexpr int steps = 15;
  const ScoreOptions options;
  const std::vector<Score> scores =
      worth_a_refit(score(records, fitted, absent_effects(fitted), options), fitted, most, options);
  const double squares = squares_at_best_phases(records, fitted).squares;
  std::vector<std::optional<LibraryRival>> found(scores.size());
  parallel_for(scores.size(), [&](std::size_t i) {
    const Fit begun = begun_refit(records, {.model = fitted, .cost = 0.5 * squares}, squares, scores[i]);
    const Fit fit = first_steps(records, begun.model, steps, {});
    if (!(fit.cost < 0.5 * squares)) return;
    const std::vector<Residuals> left = residuals(records, fit.model, fit.model.values(), {});
    const Quality with{
        squares_of(records, left), {}, memory_of(spectra_of(records, left)), FreeParameters(fit.model).size()};
    const double nats = gain(quality, with);
    if (nats < Materiality{}.nats) return;
    if (!told_from_zero(with_standard_errors(records, fit.model, true), scores[i].effect)) return;
    found[i] = LibraryRival{fit.model, std::string(fitted.about(scores[i].effect).id), nats};
  });
  std::optional<LibraryRival> best;
  for (auto& one : found) {
    if (one && (!best || one->nats > best->nats)) best = std::move(one);
  }
  return best;
}

}  // namespace emtb
