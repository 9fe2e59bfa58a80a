#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <span>
#include <string>

#include "analysis/diagnose/compare.h"
#include "analysis/diagnose/criterion.h"
#include "analysis/diagnose/known_fits.h"
#include "analysis/diagnose/likelihood.h"
#include "analysis/diagnose/refit.h"
#include "analysis/diagnose/trials.h"

namespace emtb {

/// Trials on recorded runs: each fit is a calibration on the training runs, judged on the runs held out, or where none
/// are named, on each training run while the others are fitted.
class FittedTrials final : public Trials {
 public:
  /// @param given the model as given, without pins; fits from elsewhere start from it @param refits how many in a round
  /// All but those are borrowed.
  FittedTrials(const Dataset& data, const Model& given, const Criterion& criterion, const ScoreOptions& score,
               std::size_t refits);

  /// The first fit, of the model as given, from several starts.
  /// @param start it, or with pins for what the data cannot tell
  /// @throws ModelError where it cannot be simulated
  Trial first_fit(const Model& start);

  std::optional<Trial> fit(const Model& start, const Trial* known) override;
  std::optional<Trial> fit_to_the_end(const Model& start) override;
  std::optional<Trial> fit_from_elsewhere_too(const Model& start) override;
  std::vector<Score> scores(const Trial& fitted) override;

  /// The scores that were made last, where the fit is one that they hold for but for what decides nothing; else new
  /// ones.
  std::vector<Score> scores_about(const Trial& fitted);

  Refits refits(const Trial& fitted, const std::vector<Score>& scores, Breadth breadth) override;
  std::vector<Addition> go_on(const Trial& fitted, const std::vector<Begun>& begun) override;
  std::optional<Addition> refit_at_whole_orders(const Trial& fitted) override;
  std::optional<Pair> refit_of_two(const Trial& fitted, const std::vector<Score>& scores,
                                   const std::vector<std::size_t>& added) override;
  bool determined(const Model& fitted, std::size_t effect) override;
  bool can_be(const Model& fitted, std::size_t effect) override;
  bool explains_most_runs(const Trial& trial) override;
  bool exhausted() override;

  /// @param steps no more is begun when so many have been simulated of the data (Dataset::effort)
  /// @param ends_now nor when this says so, which several threads ask; may be empty
  void bound_by(std::uint64_t steps, std::function<bool()> ends_now);

  /// So many steps more, where that bound has been met.
  void go_on_by(std::uint64_t steps);

  /// Has a bound kept anything from being tried?
  bool cut() const { return cut_; }

  /// The same of an effect that is needed: where what the data cannot tell of the model is held.
  bool determined_but_for_scale(const Model& fitted, std::size_t effect);

  /// What was found may tell what the model as given could not: a driver that blocks tells what brakes the shaft, and
  /// K_b by itself. @return none where nothing is told, or the fit is no better
  std::optional<Trial> with_told_pins_free(const Trial& found);

  /// The same with those parameters held that its effects leave untold, fitted to the end; none where they are those
  /// that are held, or where this fits no better.
  std::optional<Trial> with_pins_elsewhere(const Trial& found);

  /// The held-out runs of which something is left, most of it first, where nothing is left of any training run, or by
  /// far less: what is missing acts in them alone, and no fit has seen it.
  std::vector<std::string> runs_that_alone_show_a_remainder(const Trial& trial) const;

  /// Is far more left of a signal in the training runs than in the held-out runs that were named? These may show little
  /// of what others are full of.
  bool training_shows_more(const Trial& trial) const;

  /// Does each training run judge as well, held out in its turn, beside held-out runs that were named?
  bool training_judges() const { return training_judges_; }
  void let_training_judge(bool it_does) { training_judges_ = it_does; }

  /// The effects that were last refused for a value that they cannot have, and why.
  const std::map<std::size_t, std::string>& refused() const { return refused_; }

 private:
  /// Scores and what they were made of.
  struct Scored {
    std::vector<std::size_t> absent;  ///< effects, from the fit
    double cost = -1;                 ///< of it
    std::vector<Score> scores;
  };

  bool may_be(const Fit& judged, std::size_t effect);
  std::string pushed_to_a_bound(const Fit& judged) const;
  std::vector<Fit> begun_anew(const Trial& fitted, std::vector<Score> scores) const;
  std::vector<Addition> ended(const Trial& fitted, std::span<const Begun> begun);
  Trial fitted(const Model& start, CalibrationOptions options, const Trial* known) const;
  std::optional<Trial> no_worse_than_before(std::optional<Trial> found, const CalibrationOptions& options,
                                            const Trial* known);
  void leave_one_out(Trial& trial, const CalibrationOptions& options) const;
  Quality quality_in_training(std::span<const Residuals> left, std::size_t free_parameters) const;
  Quality quality_in_training(const Fit& fit) const;
  Loss loss_on(std::span<const Record> runs, const Model& model, const RotorPhases& phases) const;
  std::vector<const Record*> unexplained(std::span<const Record> runs, const Model& model,
                                         const RotorPhases& phases) const;

  bool ends_now() const { return ends_now_ && ends_now_(); }

  const Dataset& data_;
  const Model& given_;
  const Criterion& criterion_;
  const ScoreOptions& score_;
  std::size_t refits_;
  bool training_judges_ = false;
  Valleys valleys_;
  KnownFits known_fits_;
  Scored scored_;
  std::vector<std::string> on_bounds_at_first_;  // base parameters of the model as given
  std::map<std::size_t, std::string> refused_;
  std::uint64_t most_steps_ = std::numeric_limits<std::uint64_t>::max();
  std::function<bool()> ends_now_;
  bool exhausted_ = false, cut_ = false;
};

}  // namespace emtb
