#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "analysis/diagnose/bench_parts.h"
#include "analysis/diagnose/compare.h"
#include "analysis/diagnose/loss.h"
#include "analysis/diagnose/missing_curve.h"
#include "analysis/diagnose/next_experiment.h"
#include "analysis/diagnose/score.h"
#include "analysis/diagnose/search.h"
#include "analysis/diagnose/tied_values.h"
#include "analysis/fit/calibrate.h"
#include "analysis/fit/gauge.h"
#include "model/effect.h"
#include "model/model.h"

namespace emtb {

/// The answer in a word.
enum class Verdict {
  found,            ///< the effects named explain the data
  tied,             ///< so does each of several: these data cannot tell them apart
  unknown_effect,   ///< a material remainder that nothing in the library explains
  nothing_missing,  ///< the model is at the noise floor, or what is left is immaterial
  cannot_tell       ///< the data inform nothing
};
std::string_view word(Verdict verdict) noexcept;

struct MissingEffect {
  std::size_t effect = 0;  ///< as the model numbers them: Model::about()
  std::vector<std::size_t> tied_with;
  std::vector<Parameter> parameters;       ///< as fitted, with standard errors
  std::vector<OtherValue> otherwise = {};  ///< where a base parameter is another with one of those in its place
};

struct Diagnosis {
  Verdict verdict = Verdict::cannot_tell;
  std::vector<MissingEffect> missing;   ///< in the order found
  std::vector<Candidate> candidates;    ///< best first
  std::shared_ptr<const Dataset> data;  ///< the records on which all of this was found
  Model base, final;                    ///< both fitted to the training runs
  double base_train = 0, base_held_out = 0, final_train = 0, final_held_out = 0;
  std::map<Signal, SignalFit> signals;  ///< of the final model, on held-out runs
  std::vector<Step> steps;
  std::vector<ResidualMap> where;          ///< of the base model, on all runs: where it fails
  std::vector<ResidualMap> where_final;    ///< of the final model: what remains
  std::vector<std::string> at_bound;       ///< parameters of the final model that rest on a bound
  std::vector<Undetermined> undetermined;  ///< parameters of the final model that these data do not fix
  std::vector<Withheld> withheld;          ///< effects that were not tried
  std::vector<Pin> pins;                   ///< parameters that were held because these data cannot tell them
  bool left_one_out = false;               ///< no held-out runs were named: each run was held out in turn
  bool torque_only_loads = false;          ///< the measured torque loads the shaft as it was read, whatever its law
  bool torque_is_input = false;            ///< and has no law of the library: no model is compared with it
  bool training_judges = false;            ///< beside the held-out runs, each training run was held out in turn
  bool judged_on_training = false;         ///< a single run: nothing could be held out
  bool cut = false;                        ///< a bound on the search kept something from being tried
  std::vector<std::string> shown_by;  ///< held-out runs that alone show what is left, those that show most first: of
                                      ///< training runs nothing is, or by far less
  std::vector<std::string> shown_at_first;  ///< the same of the model as given
  std::vector<std::string> fitted_too;      ///< runs that were named as held out and alone showed what the model lacks:
                                            ///< they were then taken among the training runs, and judge no longer
  std::vector<Proposal> next;               ///< where effects tie: experiments that would tell them apart, best first
  std::vector<MissingCurve> missing_base, missing_final;  ///< the equations' remainder as curves; empty: none recovered

  /// Did the error fall in training runs, which judged one by one, and not in the held-out runs that were named?
  bool only_training_shows_it() const;

  /// What is known of an effect that the diagnosis names by its number.
  const EffectInfo& about(std::size_t effect) const { return final.about(effect); }
  std::string id(std::size_t effect) const { return std::string(about(effect).id); }
};

struct DiagnoseOptions {
  Materiality materiality;
  ScoreOptions score;
  std::size_t refits = 8;        ///< how many of the best-scored candidates are refitted in a round
  std::size_t longest_list = 6;  ///< no more effects than this are added
  double curves_from =
      above_the_floor;          ///< error of the base model, in floors, from which the missing curves are recovered
  bool explain_torque = false;  ///< whether a measured torque is to be explained where the model as given has no load;
                                ///< else it loads the shaft as it is, and what no law makes of it is no remainder
  double effort = 1;            ///< how much is simulated until what is found by then is the answer: the same on any
                                ///< machine and load, some minutes on two cores
  std::function<bool()> ends_now = {};  ///< what is found when this says so is the answer; several threads ask
  Reach reach;                          ///< of the next experiment
  bool keep_held_out = false;  ///< a held-out run that alone shows what is missing is not fitted: more can be recorded
  std::function<void(double share, const std::string& doing)> progress;  ///< may be empty
};

/// Finds out which physical effect of the catalogue, or which formula on offer, the model is missing (section 6 of the
/// design): fit; score every absent effect at zero amplitude; refit the best; keep the one that removes something
/// material from held-out runs; repeat; then try to swap each member for its rivals (those that do as well are tied
/// with it) and to do without it. Where effects tie, the next experiment is proposed. Where held-out runs alone show
/// what is missing, no fit has seen it: all is asked again with the one that shows most among the training runs.
/// @throws ModelError where the runs do not fit the model.
Diagnosis diagnose(std::span<const Run> train, std::span<const Run> held_out, const Model& model,
                   const DiagnoseOptions& options = {});

}  // namespace emtb
