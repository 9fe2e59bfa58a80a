#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "analysis/diagnose/loss.h"
#include "analysis/diagnose/score.h"
#include "analysis/fit/calibrate.h"
#include "model/model.h"

namespace emtb {

/// A model fitted to the training runs and judged on runs that it never saw.
struct Trial {
  Fit fit;
  double squares = 0;                   ///< of the residuals on the training runs, in units of sigma^2
  double train = 0;                     ///< error on them; 1 = noise floor
  Loss held_out;                        ///< on runs that the fit never saw
  RotorPhases held_out_phases{};        ///< for a fit like this one to start from
  std::optional<double> named_error{};  ///< on the held-out runs that were named, where others judge, too

  const Model& model() const { return fit.model; }

  /// What is told of runs that the fit never saw; 1 = noise floor.
  double held_out_error() const { return named_error.value_or(held_out.error()); }
};

/// A fitted model and one effect more, refitted.
struct Addition {
  Score score;
  Trial trial;

  std::size_t effect() const { return score.effect; }
};

/// Two effects at once.
struct Pair {
  std::array<std::size_t, 2> effects{};
  Trial trial;
};

/// How many of the effects that a model lacks are refitted.
enum class Breadth {
  promising,  ///< those of the best scores
  all,        ///< each that makes sense: a score is linear, and says little of a model that is far off
};

/// A refit with one effect more that was begun.
struct Begun {
  Score score;
  Fit fit;
};

/// Those that went on, and those that did not.
struct Refits {
  std::vector<Addition> done;
  std::vector<Begun> broken_off;
};

/// What a search asks of the data. Made-up answers test a search without a simulation.
class Trials {
 public:
  virtual ~Trials() = default;

  /// Fits. @param known a fit whose rotor phases hold for this one; null: they are searched
  /// @return none where nothing can be simulated from there
  virtual std::optional<Trial> fit(const Model& start, const Trial* known) = 0;

  /// Fits to the end what is kept: the last of a delay, which creeps along its edges, must not be left for the next
  /// effect to find.
  virtual std::optional<Trial> fit_to_the_end(const Model& start) = 0;

  /// The same, and where a remainder is left also from elsewhere. The base parameters of a model that lacked something
  /// may have bent into a valley of their own: the time constants of a shaft and of its tacho had changed places.
  virtual std::optional<Trial> fit_from_elsewhere_too(const Model& start) = 0;

  /// The scores of all effects that a model lacks.
  virtual std::vector<Score> scores(const Trial& fitted) = 0;

  /// Refits with one effect more. All of them descend a few steps; those that by then remove far less than the best do
  /// not go on.
  virtual Refits refits(const Trial& fitted, const std::vector<Score>& scores, Breadth breadth) = 0;

  /// Goes on with those of them that do anything: along a bent valley the first steps do little.
  virtual std::vector<Addition> go_on(const Trial& fitted, const std::vector<Begun>& begun) = 0;

  /// The refit of a wave that no spectrum shows: a torque shows where the shaft starts and stops, and runs may be
  /// shorter than a turn. Whole orders are tried one by one, on the shortest runs.
  virtual std::optional<Addition> refit_at_whole_orders(const Trial& fitted) = 0;

  /// Two effects that hide each other: where no single one helps, both together may explain most of what is left.
  /// @param scores of what the fitted model lacks @param added what it was given before
  virtual std::optional<Pair> refit_of_two(const Trial& fitted, const std::vector<Score>& scores,
                                           const std::vector<std::size_t>& added) = 0;

  /// Do the data tell the size of an effect, to three standard errors that hold for coloured residuals? A gain that
  /// several parameters of the model share out among themselves is nobody's. And is it a size that the effect can have
  /// on such a machine?
  virtual bool determined(const Model& fitted, std::size_t effect) = 0;

  /// Is what an effect was fitted to what it can be, whatever the data tell of its size?
  virtual bool can_be(const Model& fitted, std::size_t effect) = 0;

  /// Does a fit leave nothing of most runs?
  virtual bool explains_most_runs(const Trial& trial) = 0;

  /// Has as much been simulated as a search may? What is found by then is the answer.
  virtual bool exhausted() { return false; }
};

}  // namespace emtb
