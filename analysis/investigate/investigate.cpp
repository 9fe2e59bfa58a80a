#include "analysis/investigate/investigate.h"

#include <algorithm>
#include <set>
#include <utility>

#include "analysis/diagnose/foresee.h"
#include "analysis/fit/calibrate.h"
#include "analysis/fit/timing.h"
#include "analysis/record/dataset.h"
#include "experiment/first_experiments.h"
#include "hal/error.h"

namespace emtb {
namespace {

// Shares of the bench's limits that a model's foresight may use, by hand: what it does not know yet needs the rest. A
// model that was fitted to one small step is asked about a larger one of the same kind; one that foretells a run of
// another kind knows less of it.
constexpr double share_for_first = 0.9;
constexpr double share_for_foretold = 0.8;

std::vector<std::string> names_of(const std::vector<Recording>& recordings) {
  std::vector<std::string> names;
  for (const Recording& r : recordings) names.push_back(r.name);
  return names;
}

Model fitted(const Model& given, const Recording& recording) {
  Dataset data = prepare(recording.runs, {}, given);
  return calibrate(data, given).model;
}

Profile named(const Profile& profile, const std::string& name) {
  return {name, {profile.knots().begin(), profile.knots().end()}};
}

InvestigationRound round_of(const Diagnosis& d, std::size_t sessions) {
  InvestigationRound round{.verdict = d.verdict,
                           .missing = {},
                           .base = d.base_held_out,
                           .final = d.final_held_out,
                           .sessions = sessions,
                           .then = {}};
  for (const MissingEffect& m : d.missing) {
    round.missing.push_back({d.id(m.effect), {}});
    for (const std::size_t rival : m.tied_with) round.missing.back().tied_with.push_back(d.id(rival));
  }
  return round;
}

/// The loop: what is recorded so far, and what was tried.
class ClosedLoop {
 public:
  ClosedLoop(ExperimentBench& bench, const Model& given, std::vector<Recording> train, std::vector<Recording> held_out,
             const InvestigateOptions& options, InvestigationListener& listener, Investigation& found)
      : bench_(bench),
        given_(given),
        train_(std::move(train)),
        held_out_(std::move(held_out)),
        options_(options),
        listener_(listener),
        found_(found) {}

  void run() {
    if (train_.empty()) {
      const PlannedRuns first = first_runs(PlannedRuns::Why::no_sessions);
      if (!bench_.agrees(first)) return;
      make(first);
    }
    for (int round = 1;; ++round) {
      diagnose_all(round);
      if (round >= options_.rounds) break;
      const std::optional<PlannedRuns> next = next_runs(*found_.diagnosis);
      if (!next || !bench_.agrees(*next)) break;
      found_.rounds.back().then = next;
      make(*next);
    }
    if (options_.foretell && found_.diagnosis->verdict != Verdict::cannot_tell) foretell(*found_.diagnosis);
  }

 private:
  void diagnose_all(int round) {
    DiagnoseOptions options;
    options.reach = bench_.reach();
    options.keep_held_out = true;
    options.ends_now = [this] { return bench_.stop_wanted(); };
    options.progress = [this](double share, const std::string& doing) { listener_.diagnosing(share, doing); };
    Diagnosis d = diagnose(runs_of(train_), runs_of(held_out_), given_, options);
    found_.train = names_of(train_);
    found_.held_out = names_of(held_out_);
    for (const Step& s : d.steps) d.final.history.push_back({s.action, s.train, s.held_out, found_.train});
    found_.rounds.push_back(round_of(d, train_.size()));
    found_.rest.reset();
    found_.diagnosis = std::move(d);
    listener_.diagnosed(round, found_.rounds.back(), *found_.diagnosis);
  }

  /// What would tell more; nothing where the verdict stands, or where nothing would that has not been run.
  std::optional<PlannedRuns> next_runs(const Diagnosis& d) {
    if (d.verdict == Verdict::unknown_effect || d.verdict == Verdict::cannot_tell) {
      if (!recorded_first_) return first_runs(PlannedRuns::Why::undecided);
      if (!recorded_more_) return more_runs(d);
    }
    if (d.verdict == Verdict::unknown_effect && options_.discover && !recorded_law_) {
      if (auto plan = law_runs(d)) return plan;
    }
    return separating_runs(d);
  }

  /// Where a law of what is left is least sure.
  std::optional<PlannedRuns> law_runs(const Diagnosis& d) {
    constexpr double part = 0.3;  // of the time to settle: a staircase of nine levels
    listener_.diagnosing(0.99, "looking for a law in what is left");
    found_.rest = options_.discover(d, runs_of(train_), runs_of(held_out_));
    if (!found_.rest || !found_.rest->law) return std::nullopt;
    PlannedRuns plan;
    plan.why = PlannedRuns::Why::unsure_law;
    plan.law = law_experiment(*found_.rest->law, bench_.reach(), part * options_.settle);
    if (!plan.law) return std::nullopt;
    plan.train = {plan.law->fit};
    plan.held_out = {plan.law->judge};
    return plan;
  }

  PlannedRuns first_runs(PlannedRuns::Why why) const {
    const Reach reach = bench_.reach();
    Experiments first = first_experiments(reach.low, reach.high, options_.settle);
    PlannedRuns plan;
    plan.why = why;
    plan.train = std::move(first.train);
    plan.held_out = std::move(first.held_out);
    return plan;
  }

  /// Where the first runs leave a remainder without a name; nothing where the bench allows no two of them.
  std::optional<PlannedRuns> more_runs(const Diagnosis& d) const {
    std::vector<Profile> more = broader_experiments(d.final, bench_.reach());
    if (more.size() < 2) return std::nullopt;
    PlannedRuns plan;
    plan.why = PlannedRuns::Why::unnamed;
    plan.held_out = {more.back()};
    more.pop_back();
    plan.train = std::move(more);
    return plan;
  }

  /// The best experiment that this bench can make as it is wired, where it is worth making and has not been made: once
  /// to fit to, once to judge by.
  std::optional<PlannedRuns> separating_runs(const Diagnosis& d) const {
    for (const Proposal& p : d.next) {
      if (p.separation < worth_an_experiment) break;
      if (separated_by_.contains(p.profile.name())) continue;
      if (!std::ranges::all_of(p.record, [&](Signal s) { return bench_.measures(s); })) continue;
      PlannedRuns plan;
      plan.why = PlannedRuns::Why::tied;
      plan.train = {named(p.profile, p.profile.name() + "-fit")};
      plan.held_out = {named(p.profile, p.profile.name() + "-judge")};
      plan.proposal = p;
      return plan;
    }
    return std::nullopt;
  }

  void make(const PlannedRuns& plan) {
    switch (plan.why) {
      case PlannedRuns::Why::no_sessions:
      case PlannedRuns::Why::undecided:
        recorded_first_ = true;
        return make_first(plan);
      case PlannedRuns::Why::unnamed:
        recorded_more_ = true;
        return make_as_planned(plan, "investigate: what is left has no name yet", "; to judge by");
      case PlannedRuns::Why::unsure_law:
        recorded_law_ = true;
        return make_as_planned(plan, "investigate: to show the law of what is left", "; to judge by");
      case PlannedRuns::Why::tied:
        separated_by_.insert(plan.proposal->profile.name());
        return make_as_planned(plan, "investigate: to tell tied effects apart", "");
      case PlannedRuns::Why::to_be_foretold:
        break;  // foretell() makes it
    }
  }

  /// The first, a small step, says more of this motor than the model that was given: what it draws from larger ones.
  void make_first(const PlannedRuns& plan) {
    Model motor = given_;
    for (std::size_t i = 0; i < plan.train.size(); ++i) {
      const Profile profile = i == 0 ? plan.train[i] : allowed(plan.train[i], motor, share_for_first);
      train_.push_back(one_run(profile, "investigate: to fit to"));
      if (i == 0) motor = fitted(given_, train_.back());
    }
    for (const Profile& p : plan.held_out) {
      held_out_.push_back(one_run(allowed(p, motor, share_for_first), "investigate: to judge by"));
    }
  }

  void make_as_planned(const PlannedRuns& plan, const std::string& purpose, const std::string& to_judge_by) {
    for (const Profile& p : plan.train) train_.push_back(one_run(p, purpose));
    for (const Profile& p : plan.held_out) held_out_.push_back(one_run(p, purpose + to_judge_by));
  }

  /// Predicts a run that is yet to be made, then makes it, where somebody agrees.
  void foretell(const Diagnosis& d) {
    const Reach reach = bench_.reach();
    const Profile planned = confirming_experiment(reach.low, reach.high, options_.settle, options_.seed);
    PlannedRuns plan;
    plan.why = PlannedRuns::Why::to_be_foretold;
    plan.held_out = {allowed(planned, d.final, share_for_foretold)};
    const Profile& profile = plan.held_out.front();
    const std::string kept = listener_.foretold(d.final, profile);
    if (!bench_.agrees(plan)) return;
    Recording recording = one_run(profile, "investigate: confirms " + kept);
    Model judge = d.base;
    for (const auto& [signal, fit] : d.signals) judge.noise[signal] = fit.noise.sigma;
    const Comparison base = compare(recording.runs, d.base, judge), final = compare(recording.runs, d.final, judge);
    found_.foretold = ForetoldRun{profile, kept, std::move(recording), std::move(judge), base, final};
  }

  Recording one_run(const Profile& profile, const std::string& purpose) {
    if (bench_.stop_wanted()) throw Error("stopped before the run " + profile.name());
    return bench_.run(profile, purpose);
  }

  /// The profile, with smaller levels where the model foresees that it would come near a limit of the bench.
  /// @throws Error where that would leave nothing of it
  Profile allowed(const Profile& planned, const Model& model, double share) {
    if (model.input != Signal::u_ref) return planned;
    const auto smaller = within_limits(planned, model, bench_.reach().limits, share);
    if (!smaller) {
      throw Error("the model foresees that even a tenth of the run " + planned.name() +
                  " would come near a limit of the bench. Check the model's parameters and the bench's limits");
    }
    if (smaller->max() != planned.max() || smaller->min() != planned.min()) listener_.made_smaller(*smaller);
    return *smaller;
  }

  ExperimentBench& bench_;
  const Model& given_;
  std::vector<Recording> train_, held_out_;
  const InvestigateOptions& options_;
  InvestigationListener& listener_;
  Investigation& found_;
  bool recorded_first_ = false, recorded_more_ = false, recorded_law_ = false;
  std::set<std::string> separated_by_;  // profiles that were to tell tied effects apart
};

}  // namespace

std::vector<Run> runs_of(const std::vector<Recording>& recordings) {
  std::vector<Run> all;
  for (const Recording& r : recordings) all.insert(all.end(), r.runs.begin(), r.runs.end());
  return all;
}

bool Investigation::decided() const {
  return diagnosis && (diagnosis->verdict == Verdict::found || diagnosis->verdict == Verdict::nothing_missing);
}

Investigation investigate(ExperimentBench& bench, const Model& given, std::vector<Recording> train,
                          std::vector<Recording> held_out, const InvestigateOptions& options,
                          InvestigationListener& listener) {
  Investigation found;
  try {
    ClosedLoop(bench, given, std::move(train), std::move(held_out), options, listener, found).run();
  } catch (const Error& e) {
    found.broken_off = e.what();
  }
  return found;
}

}  // namespace emtb
