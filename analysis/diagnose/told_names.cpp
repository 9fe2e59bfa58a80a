#include "analysis/diagnose/told_names.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "analysis/diagnose/fitted_trials.h"
#include "analysis/diagnose/moves.h"
#include "analysis/diagnose/remainder.h"
#include "analysis/diagnose/told_from_nothing.h"
#include "analysis/fit/gauge.h"
#include "analysis/fit/logging_errors.h"
#include "analysis/fit/timing.h"
#include "hal/error.h"

namespace emtb {
namespace {

/// A model fitted to the end, with all that is known of its errors; none where it has no fit.
std::optional<Calibration> with_all_errors(const Dataset& data, const Model& model) {
  CalibrationOptions careful{.extra_starts = 0, .max_iterations = 40, .tolerance = 1e-8, .with_covariance = true};
  try {
    Calibration last = calibrate(data.train, model, careful);
    widen_by_logging(data.train, last);
    return last;
  } catch (const ModelError&) {
    return std::nullopt;
  }
}

constexpr double by_far = 5;  // errors

/// So many base parameters are held since nothing tells them.
std::ptrdiff_t pins_in(const Model& model) { return std::ranges::count(model.base, true, &Parameter::pinned); }

/// What is dropped for its errors.
struct Drops {
  std::map<std::size_t, double> costly;  ///< [nats] with which likelihood went, though it may be
  std::set<std::size_t> kept;            ///< is not dropped for them
};

/// An answer without one of its effects, and the circumstances that this is fitted under.
struct Rest {
  std::size_t effect = 0;
  Trial trial;
  Circumstances circumstances;
  double lost = 0;              ///< [nats] of likelihood
  bool may_be = true;           ///< the effect is what it is called
  bool refuted = false;         ///< the runs that were held out are foretold better without it
  std::optional<Model> held{};  ///< the answer with what makes the effect told held; then it does not go

  bool goes_before(const Rest& other) const { return refuted != other.refuted ? refuted : lost < other.lost; }
};

/// Are the held-out runs that were named foretold clearly worse by one model than by another?
bool foretells_worse(const Trial& model, const Trial& other, const Materiality& rule) {
  if (!model.named_error || !other.named_error) return false;
  const double squares = std::pow(*model.named_error, 2), fewer = std::pow(*other.named_error, 2);
  return squares - fewer > std::max(rule.least, rule.share * (squares - 1));
}

/// A search judges by quick errors. What the errors that are printed do not tell from nothing by far goes: of the laws
/// that were looked at, one is likely to be three from nothing, and what few pieces tell of an error may be off by
/// half. But not where much likelihood and a share that matters are lost with it, when timing and starts have had their
/// say, or most of what has no other name, and that is worth a name; unless it is hardly told at all and leaves enough
/// itself, or is nothing within one error. What has no size is told by what is lost with it alone. What fitted to the
/// end has gone where it is not what it is called goes as well, and where held-out runs are foretold worse than by the
/// model as given, what does that. Nothing goes without which the rest foretells other runs worse than the model as
/// given: that is no answer, whatever its errors.
class Judgement {
 public:
  Judgement(const Finding& found, const Trial& as_given, WholeSearch& search, const Criterion& criterion, Dataset& data,
            const WorthAName& worth)
      : found_(found),
        as_given_(as_given),
        search_(search),
        criterion_(criterion),
        data_(data),
        worth_(worth),
        errors_(with_all_errors(data, found.current.model())) {}

  /// What is known of the errors; none where they have no fit.
  const std::optional<Calibration>& errors() const { return errors_; }

  /// @return the answer without an effect; none where it has no fit. The circumstances are those before
  std::optional<Rest> without(std::size_t effect) {
    FittedTrials& trials = search_.trials();
    const Circumstances as_set = circumstances_of(data_);
    Model rest = found_.current.model();
    rest.exclude(effect);
    std::optional<Trial> trial = trials.fit_from_elsewhere_too(rest);
    if (!trial) return std::nullopt;
    if (settle_timing(data_, trial->model()) != TimingChange::none) trial = trials.fit_to_the_end(trial->model());
    if (trial && criterion_.worth_a_wide_search(trial->held_out))
      told_from_the_recorded(data_, search_, criterion_, *trial);
    const Circumstances of_rest = circumstances_of(data_);
    set(data_, as_set);
    if (!trial) return std::nullopt;
    const double lost = gain(*trial->held_out.quality, *found_.current.held_out.quality);
    return Rest{.effect = effect, .trial = std::move(*trial), .circumstances = of_rest, .lost = lost};
  }

  /// @return the answer without an effect that goes; none: it stays. The circumstances are those before, but for a lag
  /// within a row that is the machine's
  std::optional<Rest> without_if_it_goes(std::size_t effect) {
    std::optional<Rest> rest;
    if (foretells_worse(found_.current, as_given_, worth_.rule)) rest = without(effect);
    if (rest && foretells_worse(found_.current, rest->trial, worth_.rule)) {
      rest->refuted = true;
      return rest;
    }
    bool may_be = search_.trials().can_be(errors_->model, effect);
    if (may_be && !is_there_or_not(effect) && told_from_zero(*errors_, effect, by_far)) return std::nullopt;
    if (!rest) rest = without(effect);
    const bool counts = rest && criterion_.material(rest->trial.held_out, found_.current.held_out);
    if (may_be && is_there_or_not(effect) && counts) return std::nullopt;
    if (rest && !may_be && criterion_.remainder(rest->trial.held_out)) may_be = may_be_if_it_lags_in_itself(effect);
    if (!rest || is_needed(effect, rest->trial, may_be)) return std::nullopt;
    rest->may_be = may_be;
    rest->held = with_ratios_told(effect, rest->trial);
    return rest;
  }

 private:
  /// Then no error tells it, only what is lost without it.
  bool is_there_or_not(std::size_t effect) const { return errors_->model.about(effect).has_no_size(); }

  /// Where most comes back without an effect, and runs tell it by its ratio to a base parameter alone: the answer with
  /// that parameter held. A valley that the effect opens tells nothing of it.
  std::optional<Model> with_ratios_told(std::size_t effect, const Trial& rest) const {
    if (!removes_most(rest.held_out, found_.current.held_out)) return std::nullopt;
    const FreeParameters free(errors_->model);
    for (const std::size_t place : {base::R_a, base::K_m, base::J, base::K_b}) {
      if (std::ranges::find(free.places(), place) == free.places().end()) continue;
      if (told(data_.train, errors_->model, place)) continue;
      Model held = errors_->model;
      held.at(place).fixed = held.at(place).pinned = true;
      if (!told_from_zero(with_standard_errors(data_.train, held, true), effect, by_far)) continue;
      if (search_.trials().determined_but_for_scale(held, effect)) return held;
    }
    return std::nullopt;
  }

  /// What lags by less than a row, and no timing has its shape, is the machine: then the timing says so from now on.
  bool may_be_if_it_lags_in_itself(std::size_t effect) {
    const Timing before = data_.timing;
    if (before.lags_in_itself) return false;
    Timing in_itself = before;
    in_itself.lags_in_itself = true;
    set_timing(data_, in_itself);
    if (search_.trials().can_be(errors_->model, effect)) return true;
    set_timing(data_, before);
    return false;
  }

  bool is_needed(std::size_t effect, const Trial& rest, bool may_be) const {
    constexpr double hardly = 2, not_at_all = 1;  // errors
    if (criterion_.material(rest.held_out, as_given_.held_out)) return true;
    if (!may_be || is_there_or_not(effect) || !criterion_.remainder(rest.held_out)) return false;
    const Loss& whole = found_.current.held_out;
    const bool most = removes_most(rest.held_out, whole);
    const bool much_less_likely = gain(*rest.held_out.quality, *whole.quality) > by_far_likelier;
    // Where its parameters go with others, no error tells one of them, and all of them together are told by what is
    // lost.
    if (!most || !much_less_likely) {
      const double least = criterion_.remainder(whole) ? hardly : not_at_all;
      if (!search_.trials().determined_but_for_scale(errors_->model, effect)) return false;
      if (!told_but_for_scale(data_.train, *errors_, effect, least)) return false;
    }
    return (much_less_likely && leaves_a_share(rest.held_out, worth_.inputs, worth_.rule)) ||
           (most && worth_a_name(data_, rest.model(), rest.held_out, worth_.inputs, worth_.rule));
  }

  const Finding& found_;
  const Trial& as_given_;
  WholeSearch& search_;
  const Criterion& criterion_;
  Dataset& data_;
  const WorthAName& worth_;
  std::optional<Calibration> errors_;
};

/// Drops what a judgement lets go, that with which least is lost first: beside what stands in for it, an effect may be
/// told as little as that. What is told goes in its place where less is lost with it, and what was not told is told
/// without it.
/// @return what is known of the errors of the rest
std::optional<Calibration> drop_what_is_not_told(Finding& found, const Trial& as_given, WholeSearch& search,
                                                 const Criterion& criterion, Dataset& data, const WorthAName& worth,
                                                 Drops& drops) {
  const auto id = [&](std::size_t effect) { return std::string(found.current.model().about(effect).id); };
  while (true) {
    Judgement judgement(found, as_given, search, criterion, data, worth);
    std::vector<std::size_t> staying;
    std::optional<Rest> least;
    std::optional<Trial> held;
    for (std::size_t i = found.effects.size(); judgement.errors() && i > 0; --i) {
      const std::size_t effect = found.effects[i - 1];
      if (needed(effect, found.current.model()) || drops.kept.contains(effect)) continue;
      std::optional<Rest> rest = judgement.without_if_it_goes(effect);
      if (rest && rest->held) held = search.trials().fit_from_elsewhere_too(*rest->held);
      if (held && pins_in(held->model()) <= pins_in(found.current.model())) held.reset();  // the fit let it go again
      if (held) break;
      if (!rest) staying.push_back(effect);
      if (rest && (!least || rest->goes_before(*least))) least = std::move(rest);
    }
    if (held) {
      found.current = std::move(*held);
      continue;
    }
    if (!least) return judgement.errors();
    const bool there_or_not = found.current.model().about(least->effect).has_no_size();
    std::string why = least->refuted ? ": without it held-out runs are foretold better"
                      : there_or_not ? ": nothing is gained by it"
                                     : ": its own errors do not tell it from nothing";
    const bool may_be = least->may_be && !least->refuted;
    if (may_be && least->lost > worth.rule.nats) drops.costly.insert_or_assign(least->effect, least->lost);
    const std::size_t not_told = least->effect;
    const auto stays_in = [&](const Rest& rest, std::size_t effect) {
      Finding other = found;
      other.current = rest.trial;
      std::erase(other.effects, rest.effect);
      const Circumstances as_set = circumstances_of(data);
      set(data, rest.circumstances);
      Judgement of_rest(other, as_given, search, criterion, data, worth);
      const bool stays = of_rest.errors() && !of_rest.without_if_it_goes(effect);
      set(data, as_set);
      return stays;
    };
    if (least->refuted || !least->may_be) staying.clear();  // it goes by itself
    for (const std::size_t effect : staying) {
      std::optional<Rest> rest = judgement.without(effect);
      if (!rest || rest->lost >= least->lost || rest->trial.held_out.error() >= least->trial.held_out.error()) continue;
      if (!stays_in(*rest, not_told)) continue;
      least = std::move(rest);
      why = ": of it and " + id(not_told) + " only one is told, and that explains more";
    }
    set(data, least->circumstances);
    found.steps.push_back(
        {"dropped " + id(least->effect) + why, {}, least->trial.train, least->trial.held_out_error()});
    found.current = std::move(least->trial);
    std::erase(found.effects, least->effect);
    found.rivals.erase(least->effect);
  }
}

/// The effects of one list that another lacks.
std::vector<std::size_t> gone(std::vector<std::size_t> before, const std::vector<std::size_t>& after) {
  std::erase_if(before, [&](std::size_t effect) { return std::ranges::find(after, effect) != after.end(); });
  return before;
}

/// What was found, in which something is left, and what more is found without some effects.
Finding gone_on_without(Finding found, std::span<const std::size_t> effects, WholeSearch& search,
                        const Loss& as_given) {
  std::vector<std::size_t>& withheld = found.current.fit.model.withheld;
  withheld.insert(withheld.end(), effects.begin(), effects.end());
  return search.gone_on(std::move(found), as_given);
}

/// What was tried before a search anew, and not in it, is told as well.
void remember(std::vector<Candidate>& candidates, const std::vector<Candidate>& before) {
  for (const Candidate& c : before) {
    const auto same = [&](const Candidate& other) { return other.score.effect == c.score.effect; };
    if (std::ranges::none_of(candidates, same)) candidates.push_back(c);
  }
}

/// The likeliest answer that was dropped from, and what it was found in.
struct Likeliest {
  Road road;
  Circumstances circumstances;
  bool training_judged = false;

  void consider(const Road& other, const Dataset& data, bool training_judges) {
    const bool comparable = training_judges == training_judged;
    if (!comparable || gain(*road.found.current.held_out.quality, *other.found.current.held_out.quality) <= 0) return;
    road = other;
    circumstances = circumstances_of(data);
  }
};

/// Drops, and goes on without.
std::optional<Calibration> keep_what_errors_tell(Road& road, const SearchWithout& without, WholeSearch& search,
                                                 const Criterion& criterion, Dataset& data, const WorthAName& worth,
                                                 Drops& drops, Likeliest& likeliest) {
  FittedTrials& trials = search.trials();
  while (true) {
    likeliest.consider(road, data, trials.training_judges());
    Finding& found = road.found;
    if (auto freed = trials.with_told_pins_free(found.current)) found.current = std::move(*freed);
    if (auto other = trials.with_pins_elsewhere(found.current)) found.current = std::move(*other);
    const std::vector<std::size_t> before = found.effects;
    std::optional<Calibration> judged = drop_what_is_not_told(found, road.first, search, criterion, data, worth, drops);
    const std::vector<std::size_t> dropped = gone(before, found.effects);
    if (!dropped.empty()) found = search.with_rivals_renewed(std::move(found), road.first.held_out);
    const Loss& left = found.current.held_out;
    const bool torque_had_a_law = search.torque_has_a_law();
    const auto is_law_of_a_load = [&](std::size_t effect) {
      return torque_had_a_law && found.current.model().about(effect).stage == Stage::load;
    };
    const bool is_left = criterion.remainder(left) || criterion.worth_trying_all(left) ||
                         std::ranges::any_of(dropped, is_law_of_a_load);  // the rest was found beside it
    if (dropped.empty() || !is_left || trials.exhausted()) return judged;
    std::vector<std::size_t> refused = dropped;
    std::erase_if(refused,
                  [&](std::size_t effect) { return !trials.refused().contains(effect) && !is_law_of_a_load(effect); });
    const Circumstances as_set = circumstances_of(data);
    const bool training_judged = trials.training_judges();
    Road other = refused.empty()
                     ? Road{road.first, gone_on_without(found, dropped, search, road.first.held_out), as_set}
                     : without(refused);
    Trial so_far = found.current;
    const bool law_went = torque_had_a_law && !search.torque_has_a_law();
    if (trials.training_judges() != training_judged || law_went) {  // a search anew may have called them in
      set(data, as_set);
      so_far = search.again(so_far);
      set(data, other.circumstances);
    }
    // What was found beside a law of the load that is none stands where it does better alone.
    const Loss &before_it = so_far.held_out, &after_it = other.found.current.held_out;
    if (law_went ? criterion.material(after_it, before_it) : !criterion.material(before_it, after_it)) {
      trials.let_training_judge(training_judged);
      set(data, as_set);
      return judged;
    }
    remember(other.found.candidates, found.candidates);
    road = std::move(other);
  }
}

}  // namespace

std::optional<Calibration> keep_what_is_told(Road& road, const SearchWithout& without, WholeSearch& search,
                                             const Criterion& criterion, Dataset& data, const WorthAName& worth) {
  FittedTrials& trials = search.trials();
  Likeliest likeliest{road, circumstances_of(data), trials.training_judges()};
  Drops drops;
  while (true) {
    std::optional<Calibration> judged =
        keep_what_errors_tell(road, without, search, criterion, data, worth, drops, likeliest);
    const Loss &after = road.found.current.held_out, &best = likeliest.road.found.current.held_out;
    const bool comparable = trials.training_judges() == likeliest.training_judged;
    const bool nothing_else = comparable && carries_most(after, best);
    if (drops.costly.empty() || !criterion.remainder(after) || !nothing_else) return judged;
    // Nothing has taken the place of what went: its errors are wide since something else is missing beside it. What
    // carried most stays from now on.
    set(data, likeliest.circumstances);
    road = likeliest.road;
    drops.kept.insert(std::ranges::max_element(drops.costly, {}, &std::pair<const std::size_t, double>::second)->first);
    drops.costly.clear();
  }
}

}  // namespace emtb
