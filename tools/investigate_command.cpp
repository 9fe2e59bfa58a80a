#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "analysis/diagnose/diagnose.h"
#include "analysis/diagnose/foresee.h"
#include "analysis/fit/calibrate.h"
#include "config/bench.h"
#include "config/model.h"
#include "config/profile.h"
#include "config/yaml.h"
#include "experiment/first_experiments.h"
#include "hal/error.h"
#include "report/report_page.h"
#include "report/result_json.h"
#include "report/text.h"
#include "report/verdict.h"
#include "server/client.h"
#include "session/spec.h"
#include "tools/bench_run.h"
#include "tools/commands.h"
#include "tools/prediction.h"
#include "tools/progress.h"

namespace emtb {
namespace {

using json = nlohmann::ordered_json;

struct InvestigateOptions {
  std::shared_ptr<const std::string> socket;
  std::string model, folder = "investigation", json_file, report, command;
  std::vector<std::string> sessions, held_out;
  double reach = 0.9, settle = 10, seed = 7;
  int rounds = 4;
  bool yes = false, reset = false, no_confirm = false;
};

/// The bench at the other end of the socket, which moves only after somebody agreed.
class Bench {
 public:
  explicit Bench(const InvestigateOptions& o) : daemon_(socket_to_call(*o.socket)), yes_(o.yes) {
    const nlohmann::json config = daemon_.call("config", nlohmann::json::object());
    name_ = config["bench"];
    rate_ = config["rate"];
    reach_.low = o.reach * config["reference"]["min"].get<double>();
    reach_.high = o.reach * config["reference"]["max"].get<double>();
    const auto limits = parse_bench(config["text"], config["file"].get<std::string>()).limits;
    reach_.longest = limits.time.value_or(reach_.longest);
    if (limits.i_a) reach_.limits[Signal::i_a] = *limits.i_a;
    if (limits.omega) reach_.limits[Signal::omega] = *limits.omega;
    if (limits.torque) reach_.limits[Signal::torque] = *limits.torque;
    for (const auto& channel : config["channels"]) {
      if (const auto signal = signal_named(channel["signal"].get<std::string>())) signals_.push_back(*signal);
    }
    daemon_.call("subscribe", {{"rate", 10}});
    if (o.reset) daemon_.call("reset", nlohmann::json::object());
  }

  const std::string& name() const { return name_; }
  double rate() const { return rate_; }  ///< [Hz]
  const Reach& reach() const { return reach_; }
  bool measures(Signal signal) const { return std::ranges::find(signals_, signal) != signals_.end(); }

  /// Asks before the motor moves. @throws Error where there is nobody to ask.
  bool agreed(const std::string& question) const {
    std::cout << question << " [y/N] " << std::flush;
    if (yes_) {
      std::cout << "yes (--yes)" << std::endl;
      return true;
    }
    if (isatty(STDIN_FILENO) != 1) {
      std::cout << std::endl;
      throw Error("nobody can be asked whether the motor may move: add --yes, or call it from a terminal");
    }
    std::string answer;
    std::getline(std::cin, answer);
    return answer == "y" || answer == "Y" || answer == "yes";
  }

  /// @return the session's path. @throws Error where the run did not end as planned.
  std::string run(const Profile& profile, const std::string& note) {
    const nlohmann::json ended = run_on_bench(daemon_, {{"profile", to_yaml(profile)}, {"note", note}});
    const std::string session = ended["session"];
    std::cout << "  " << session << std::endl;
    if (ended["outcome"] != "done") {
      throw Error("the run " + profile.name() + " ended early: " + why_it_ended(ended) +
                  ". See to the bench, `emtb reset`, then go on with the sessions above");
    }
    return session;
  }

 private:
  Client daemon_;
  bool yes_;
  std::string name_;
  double rate_ = 0;
  Reach reach_;
  std::vector<Signal> signals_;
};

std::vector<Run> runs_of(const std::vector<std::string>& sessions) {
  std::vector<Run> all;
  for (const std::string& session : sessions) std::ranges::move(read_runs(session), std::back_inserter(all));
  return all;
}

std::string seconds(double s) { return pretty(s, 3) + " s"; }

/// One investigation: sessions and rounds so far.
class Investigation {
 public:
  Investigation(const InvestigateOptions& o, Bench& bench)
      : o_(o), bench_(bench), train_(o.sessions), held_out_(o.held_out) {
    std::filesystem::create_directories(o.folder);
  }

  /// Where no sessions are at hand yet, or those at hand cannot tell. @return false where nobody agrees
  bool record_first(const std::string& why, const Model& given) {
    const Experiments first = first_experiments(bench_.reach().low, bench_.reach().high, o_.settle);
    double total = 0;
    for (const auto* list : {&first.train, &first.held_out}) {
      for (const Profile& p : *list) total += p.duration();
    }
    if (!bench_.agreed(why + " Six experiments: " + pretty(bench_.reach().low) + " to " + pretty(bench_.reach().high) +
                       " V, " + seconds(total) + " in all?")) {
      return false;
    }
    recorded_first_ = true;
    // The first, a small step, says more of this motor than the model that was given: what it draws from larger ones.
    Model motor = given;
    bool nothing_yet = true;
    const auto record = [&](std::vector<std::string>& sessions, const Profile& planned, const char* note) {
      const bool first_of_all = std::exchange(nothing_yet, false);
      sessions.push_back(bench_.run(first_of_all ? planned : allowed(planned, motor, little_unknown), note));
      if (first_of_all) motor = fitted(given, sessions.back());
    };
    if (!story_.rounds.empty()) story_.rounds.back().then = "six experiments to begin with";
    for (const Profile& p : first.train) record(train_, p, "investigate: to fit to");
    for (const Profile& p : first.held_out) record(held_out_, p, "investigate: to judge by");
    return true;
  }

  /// Where six experiments leave a remainder without a name: longer ones, of more kinds. @return false where nobody
  /// agrees, or the bench allows none
  bool record_more(const Diagnosis& d) {
    const std::vector<Profile> more = broader_experiments(d.final, bench_.reach());
    if (more.size() < 2) return false;
    double total = 0;
    for (const Profile& p : more) total += p.duration();
    const std::string what = std::to_string(more.size()) + " longer experiments, " + seconds(total) + " in all";
    if (!bench_.agreed("What is left has no name yet. Run " + what + "?")) return false;
    recorded_more_ = true;
    for (std::size_t i = 0; i + 1 < more.size(); ++i) {
      train_.push_back(bench_.run(more[i], "investigate: what is left has no name yet"));
    }
    held_out_.push_back(bench_.run(more.back(), "investigate: what is left has no name yet; to judge by"));
    story_.rounds.back().then = what;
    return true;
  }

  /// Diagnoses, and runs what tells tied effects apart, until the verdict stands or nothing more can be learnt.
  void learn(const Model& given) {
    for (int round = 1;; ++round) {
      latest_ = {diagnosed(given, round), train_, held_out_};
      const Diagnosis& d = latest_->diagnosis;
      if (round >= o_.rounds) return;
      const bool open = d.verdict == Verdict::unknown_effect || d.verdict == Verdict::cannot_tell;
      if (open && !recorded_first_) {
        if (!record_first("These sessions leave it open.", given)) return;
        continue;
      }
      if (open && !recorded_more_) {
        if (!record_more(d)) return;
        continue;
      }
      const Proposal* next = next_of(d);
      if (next == nullptr) return;
      const Profile& profile = next->profile;
      const std::string what = next->what + " (" + pretty(profile.min()) + " to " + pretty(profile.max()) + " V, " +
                               seconds(profile.duration()) + ")";
      if (!bench_.agreed("Run, to fit to and once more to judge by: " + what + "?")) return;
      run_already_.insert(profile.name());
      const std::string why = "investigate: to tell tied effects apart";
      train_.push_back(bench_.run(named(profile, profile.name() + "-fit"), why));
      held_out_.push_back(bench_.run(named(profile, profile.name() + "-judge"), why));
      story_.rounds.back().then = "`" + profile.name() + "`: " + what + ", twice, which was to bring the predictions " +
                                  pretty(next->separation, 2) + " noise floors apart";
    }
  }

  /// Predicts a run that is yet to be made, then makes it, where somebody agrees.
  void confirm() {
    const Diagnosis& d = latest_->diagnosis;
    if (d.verdict == Verdict::cannot_tell) return;
    const auto seed = static_cast<std::uint64_t>(o_.seed);
    const Profile planned = confirming_experiment(bench_.reach().low, bench_.reach().high, o_.settle, seed);
    const Profile profile = allowed(planned, d.final, much_unknown);
    const std::string said = (std::filesystem::path(o_.folder) / "prediction.csv").string();
    write_session(said, prediction(d.final, profile, bench_.rate()));
    std::cout << "\nConfirm: what the model says of a run that nobody has seen is in " << said << std::endl;
    if (!bench_.agreed("Run it (" + pretty(profile.min()) + " to " + pretty(profile.max()) + " V, " +
                       seconds(profile.duration()) + ")?")) {
      return;
    }
    const std::string session = bench_.run(profile, "investigate: confirms " + said);
    const std::vector<Run> runs = read_runs(session);
    Model judge = d.base;  // the floors of the diagnosis, not those of one run without a settled stretch
    for (const auto& [signal, fit] : d.signals) judge.noise[signal] = fit.noise.sigma;
    const Comparison before = compare(runs, d.base, judge), after = compare(runs, d.final, judge);
    Table table({"predicted from the reference alone", "given model", "found model", "unit"});
    for (const auto& [signal, fit] : after.signals) {
      const double floor = fit.noise.sigma;
      table.row({std::string(info(signal).name) + " RMSE", pretty(before.chained.at(signal) * floor, 3),
                 pretty(after.chained.at(signal) * floor, 3), std::string(info(signal).unit)});
    }
    table.row({"error (1 = noise floor)", pretty(before.chained_error, 4), pretty(after.chained_error, 4), ""});
    std::cout << table.text();
    confirmed_ = {{"profile", to_yaml(profile)},
                  {"prediction", said},
                  {"session", session},
                  {"base", {{"error", before.error}, {"chained_error", before.chained_error}}},
                  {"final", {{"error", after.error}, {"chained_error", after.chained_error}}}};
    story_.foretold = {said, session, runs.front(), judge, before.chained_error, after.chained_error};
  }

  /// Whether the verdict stands, and a run that was foretold has been made where one was wanted.
  bool settled() const {
    const Verdict verdict = latest_->diagnosis.verdict;
    return (verdict == Verdict::found || verdict == Verdict::nothing_missing) && (o_.no_confirm || story_.foretold);
  }

  /// What is known, if anything is: also where a run was refused or ended early.
  void write(const Model& given) const {
    if (!latest_) return;
    const auto& [d, train, held_out] = *latest_;
    const std::string found = (std::filesystem::path(o_.folder) / "found.yaml").string();
    write_model(found, d.final);
    json all{{"rounds", rounds_}, {"sessions", train},       {"held_out", held_out},
             {"model", found},    {"diagnosis", to_json(d)}, {"confirmed", confirmed_}};
    write_json(o_.json_file, all);
    if (!o_.report.empty()) {
      ReportInput in = ReportInput::of(o_.model, given, o_.command);
      for (const std::string& s : train) in.add(s, false);
      for (const std::string& s : held_out) in.add(s, true);
      in.story = story_;
      write_page(o_.report, report_page(in, d), "--report");
      std::cout << "\nAll of it as a page: " << o_.report << std::endl;
    }
    std::cout << "\nThe model with what was found: " << found << std::endl;
  }

 private:
  /// A diagnosis, and the sessions that it is of.
  struct Learnt {
    Diagnosis diagnosis;
    std::vector<std::string> train, held_out;
  };

  static constexpr double much_unknown = 0.8, little_unknown = 0.9;  ///< shares of the bench's limits that are used

  static Model fitted(const Model& given, const std::string& session) {
    const std::vector<Run> runs = runs_of({session});
    return calibrate(prepare(runs, {}, given).train, given).model;
  }

  /// The profile, with smaller levels where the model foresees that it would come near a limit of the bench.
  /// @throws Error where that would leave nothing of it
  Profile allowed(const Profile& planned, const Model& model, double share) const {
    if (model.input != Signal::u_ref) return planned;
    const auto smaller = within_limits(planned, model, bench_.reach().limits, share);
    if (!smaller) {
      throw Error("the model foresees that even a tenth of the run " + planned.name() +
                  " would come near a limit of the bench. Check the model's parameters and the bench's limits");
    }
    if (smaller->max() != planned.max() || smaller->min() != planned.min()) {
      std::cout << "  " << planned.name() << ": " << pretty(smaller->min(), 3) << " to " << pretty(smaller->max(), 3)
                << " V, for more would come near a limit of the bench" << std::endl;
    }
    return *smaller;
  }

  Diagnosis diagnosed(const Model& given, int round) {
    Progress progress;
    DiagnoseOptions options;
    options.reach = bench_.reach();
    options.progress = [&](double share, const std::string& doing) { progress.show(share, doing); };
    Diagnosis d = diagnose(runs_of(train_), runs_of(held_out_), given, options);
    progress.clear();
    for (const Step& s : d.steps) d.final.history.push_back({s.action, s.train, s.held_out, train_});
    std::cout << "\nRound " << round << ", " << train_.size() << " sessions: error " << pretty(d.base_held_out)
              << " -> " << pretty(d.final_held_out) << " times the noise floor on held-out runs\n"
              << verdict_text(d) << std::flush;
    json names = json::array();
    for (const MissingEffect& m : d.missing) {
      json tied = json::array();
      for (const std::size_t rival : m.tied_with) tied.push_back(d.id(rival));
      names.push_back({{"id", d.id(m.effect)}, {"tied_with", tied}});
    }
    story_.rounds.push_back({train_.size(), d.base_held_out, d.final_held_out, answer_of(d), {}});
    rounds_.push_back({{"verdict", word(d.verdict)},
                       {"missing", names},
                       {"base", d.base_held_out},
                       {"final", d.final_held_out},
                       {"sessions", train_.size()}});
    return d;
  }

  static Profile named(const Profile& profile, const std::string& name) {
    return {name, {profile.knots().begin(), profile.knots().end()}};
  }

  /// The best experiment that this bench can make as it is wired, where it is worth making and has not been made.
  const Proposal* next_of(const Diagnosis& d) const {
    for (const Proposal& p : d.next) {
      if (p.separation < worth_an_experiment) break;
      if (run_already_.contains(p.profile.name())) continue;
      if (std::ranges::all_of(p.record, [&](Signal s) { return bench_.measures(s); })) return &p;
    }
    return nullptr;
  }

  const InvestigateOptions& o_;
  Bench& bench_;
  std::vector<std::string> train_, held_out_;
  bool recorded_first_ = false, recorded_more_ = false;
  std::optional<Learnt> latest_;
  std::set<std::string> run_already_;  // profiles that were to tell tied effects apart
  json rounds_ = json::array();
  json confirmed_;
  InvestigationStory story_;
};

int investigate_command(const InvestigateOptions& o) {
  if (!(o.reach > 0 && o.reach <= 1)) throw Error("--reach is a share of the bench's reference: above 0, at most 1");
  if (o.sessions.empty() && !o.held_out.empty()) {
    throw Error("--held-out judges a fit to --sessions: give those, too, or neither for six experiments first");
  }
  const Model given = read_model(o.model);
  if (!o.report.empty() && !std::ofstream(o.report, std::ios::app)) {  // now, not after an hour of experiments
    throw Error(o.report + ": cannot be written. Give another --report FILE.html");
  }
  catch_interrupt();
  Bench bench(o);
  std::cout << "bench " << bench.name() << ", model " << o.model << "\n";
  Investigation investigation(o, bench);
  if (o.sessions.empty() && !investigation.record_first("No sessions are given.", given)) return 1;
  try {
    investigation.learn(given);
    if (!o.no_confirm) investigation.confirm();
  } catch (const Error&) {
    investigation.write(given);
    throw;
  }
  investigation.write(given);
  return investigation.settled() ? 0 : 1;
}

}  // namespace

void add_investigate_command(CommandLine& line, const std::shared_ptr<const std::string>& socket, int argc,
                             const char* const* argv) {
  const auto o = std::make_shared<InvestigateOptions>();
  o->command = as_called(argc, argv);
  o->socket = socket;
  line.command("investigate",
               "lets the bench find out what the model is missing: diagnose, run what tells more, repeat")
      .argument("MODEL", o->model, "the model's YAML, as far as it is known")
      .options("--sessions", o->sessions, "recordings to begin with; without them six experiments are made first")
      .options("--held-out", o->held_out, "those of them that judge and take no part in a fit")
      .flag("--yes", o->yes, "moves the motor without asking")
      .flag("--reset", o->reset, "arms the bench first; see that it is safe")
      .option("--reach", o->reach, "the share of the bench's reference that is used [0.9]")
      .option("--settle", o->settle, "[s] the motor takes to settle, and a slow meter for some readings [10]")
      .option("--rounds", o->rounds, "diagnoses at most [4]")
      .option("--seed", o->seed, "of the run that confirms [7]")
      .flag("--no-confirm", o->no_confirm, "leaves away the run that is predicted before it is made")
      .option("--out", o->folder, "folder for the model found and the prediction [investigation]")
      .option("--report", o->report, "writes a page of all rounds, the prediction and the diagnosis to this file")
      .option("--json", o->json_file, "writes all of it to this file; - for standard output")
      .action([o] { return investigate_command(*o); });
}

}  // namespace emtb
