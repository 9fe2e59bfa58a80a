#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "analysis/investigate/investigate.h"
#include "config/bench.h"
#include "config/model.h"
#include "config/profile.h"
#include "hal/error.h"
#include "report/discovery_json.h"
#include "report/discovery_words.h"
#include "report/investigation_story.h"
#include "report/progress.h"
#include "report/report_page.h"
#include "report/result_json.h"
#include "report/text.h"
#include "report/verdict.h"
#include "server/client.h"
#include "session/gaps.h"
#include "session/spec.h"
#include "tools/bench_run.h"
#include "tools/checked.h"
#include "tools/commands.h"
#include "tools/discover_rest.h"
#include "tools/offered_words.h"
#include "tools/prediction.h"

namespace emtb {
namespace {

using json = nlohmann::ordered_json;

/// The words of the command line.
struct InvestigateWords {
  std::shared_ptr<const std::string> socket;
  std::string model, folder = "investigation", json_file, report, command;
  std::vector<std::string> sessions, held_out;
  Wanted wanted;
  double reach = 0.9, settle = 10, seed = 7;
  int rounds = 4;
  bool yes = false, reset = false, no_confirm = false, unchecked = false;
};

/// The bench at the other end of the socket, which moves only after somebody agreed.
class DaemonBench : public ExperimentBench {
 public:
  explicit DaemonBench(const InvestigateWords& o) : daemon_(socket_to_call(*o.socket)), yes_(o.yes), reset_(o.reset) {
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
  }

  const std::string& name() const { return name_; }
  double rate() const { return rate_; }  ///< [Hz]
  Reach reach() const override { return reach_; }
  bool measures(Signal signal) const override { return std::ranges::find(signals_, signal) != signals_.end(); }
  bool stop_wanted() const override { return interrupted(); }

  /// Asks first, and arms then.
  bool agrees(const PlannedRuns& plan) override {
    if (!motor_may_move(question(plan), yes_)) return false;
    if (reset_) daemon_.call("reset", nlohmann::json::object());
    reset_ = false;
    return true;
  }

  Recording run(const Profile& profile, const std::string& purpose) override {
    const nlohmann::json ended = run_on_bench(daemon_, {{"profile", to_yaml(profile)}, {"note", purpose}});
    const std::string session = ended["session"];
    std::cout << "  " << session << std::endl;
    if (ended["outcome"] != "done") {
      throw Error("the run " + profile.name() + " ended early: " + why_it_ended(ended) +
                  ". See to the bench, `emtb reset`, then go on with the sessions above");
    }
    return {session, read_runs(session)};
  }

 private:
  Client daemon_;
  bool yes_, reset_;
  std::string name_;
  double rate_ = 0;
  Reach reach_;
  std::vector<Signal> signals_;
};

/// Tells a person, and keeps predictions in a folder.
class Terminal : public InvestigationListener {
 public:
  /// @param rate [Hz] of predictions
  Terminal(std::filesystem::path folder, double rate) : folder_(std::move(folder)), rate_(rate) {}

  void diagnosing(double share, const std::string& doing) override { progress_.show(share, doing); }

  void diagnosed(int round, const InvestigationRound& r, const Diagnosis& d) override {
    progress_.clear();
    std::cout << "\nRound " << round << ", " << r.sessions << " sessions: error " << pretty(r.base) << " -> "
              << pretty(r.final) << " times the noise floor on held-out runs\n"
              << verdict_text(d) << std::flush;
  }

  void made_smaller(const Profile& smaller) override {
    std::cout << "  " << smaller.name() << ": " << pretty(smaller.min(), 3) << " to " << pretty(smaller.max(), 3)
              << " V, for more would come near a limit of the bench" << std::endl;
  }

  std::string foretold(const Model& model, const Profile& profile) override {
    const std::string said = (folder_ / "prediction.csv").string();
    write_session(said, prediction(model, profile, rate_));
    std::cout << "\nConfirm: what the model says of a run that nobody has seen is in " << said << std::endl;
    return said;
  }

 private:
  std::filesystem::path folder_;
  double rate_;
  Progress progress_;
};

std::vector<Recording> recordings(const std::vector<std::string>& sessions) {
  std::vector<Recording> all;
  for (const std::string& session : sessions) all.push_back({session, read_runs(session)});
  return all;
}

void tell_foretold(const ForetoldRun& foretold) {
  Table table({"predicted from the reference alone", "given model", "found model", "unit"});
  for (const auto& [signal, fit] : foretold.final.signals) {
    const double floor = fit.noise.sigma;
    table.row({std::string(info(signal).name) + " RMSE", pretty(foretold.base.chained.at(signal) * floor, 3),
               pretty(foretold.final.chained.at(signal) * floor, 3), std::string(info(signal).unit)});
  }
  table.row(
      {"error (1 = noise floor)", pretty(foretold.base.chained_error, 4), pretty(foretold.final.chained_error, 4), ""});
  std::cout << table.text();
}

/// What is known, if anything is: also where a run was refused or ended early.
void write(const Investigation& found, const InvestigateWords& o, const Model& given) {
  if (!found.diagnosis) return;
  const Diagnosis& d = *found.diagnosis;
  const auto runs_of = [&](const std::vector<std::string>& sessions) {
    std::vector<Run> runs;
    for (const Recording& r : recordings(sessions)) std::ranges::move(r.runs, std::back_inserter(runs));
    return split_at_gaps(runs, given.input);
  };
  const std::shared_ptr<const Discovery> rest =
      found.rest ? found.rest : discover_rest(d, runs_of(found.train), runs_of(found.held_out));
  if (rest) std::cout << "\n" << discovery_text(*rest);
  const std::string model = (std::filesystem::path(o.folder) / "found.yaml").string();
  write_model(model, d.final);
  write_json(o.json_file, json{{"rounds", rounds_json(found)},
                               {"sessions", found.train},
                               {"held_out", found.held_out},
                               {"model", model},
                               {"diagnosis", to_json(d)},
                               {"discovered", rest ? to_json(*rest) : json(nullptr)},
                               {"confirmed", foretold_json(found)}});
  if (!o.report.empty()) {
    ReportInput in = ReportInput::of(o.model, given, o.command);
    for (const std::string& s : found.train) in.add(s, false);
    for (const std::string& s : found.held_out) in.add(s, true);
    in.investigation = &found;
    in.discovery = rest.get();
    write_page(o.report, report_page(in, d), "--report");
    std::cout << "\nAll of it as a page: " << o.report << std::endl;
  }
  std::cout << "\nThe model with what was found: " << model << std::endl;
}

int investigate_command(const InvestigateWords& o) {
  if (!(o.reach > 0 && o.reach <= 1)) throw Error("--reach is a share of the bench's reference: above 0, at most 1");
  if (o.sessions.empty() && !o.held_out.empty()) {
    throw Error("--held-out judges a fit to --sessions: give those, too, or neither for six experiments first");
  }
  Model given = read_model(o.model);
  withhold_unwanted(given, o.wanted);
  if (!o.report.empty() && !std::ofstream(o.report, std::ios::app)) {  // now, not after an hour of experiments
    throw Error(o.report + ": cannot be written. Give another --report FILE.html");
  }
  catch_interrupt();
  std::vector<Recording> train = recordings(o.sessions), held_out = recordings(o.held_out);
  if (!may_be_fitted(runs_of(train), runs_of(held_out), given, o.unchecked, std::cout)) return 1;
  for (std::vector<Recording>* part : {&train, &held_out}) {
    for (Recording& r : *part) r.runs = split_at_gaps(r.runs, given.input);
  }
  DaemonBench bench(o);
  std::cout << "bench " << bench.name() << ", model " << o.model << "\n";
  std::filesystem::create_directories(o.folder);
  const InvestigateOptions options{.rounds = o.rounds,
                                   .settle = o.settle,
                                   .foretell = !o.no_confirm,
                                   .seed = static_cast<std::uint64_t>(o.seed),
                                   .discover = discover_rest};
  const Investigation found = [&] {
    Terminal terminal(o.folder, bench.rate());
    return investigate(bench, given, train, held_out, options, terminal);
  }();
  if (found.foretold) tell_foretold(*found.foretold);
  write(found, o, given);
  if (!found.broken_off.empty()) throw Error(found.broken_off);
  return found.decided() && (o.no_confirm || found.foretold) ? 0 : 1;
}

}  // namespace

void add_investigate_command(CommandLine& line, const std::shared_ptr<const std::string>& socket, int argc,
                             const char* const* argv) {
  const auto o = std::make_shared<InvestigateWords>();
  o->command = as_called(argc, argv);
  o->socket = socket;
  line.command("investigate",
               "lets the bench find out what the model is missing: diagnose, run what tells more, repeat")
      .argument("MODEL", o->model, "the model's YAML, as far as it is known")
      .options("--sessions", o->sessions, "recordings to begin with; without them six experiments are made first")
      .options("--held-out", o->held_out, "those of them that judge and take no part in a fit")
      .options("--only", o->wanted.only, only_help)
      .offers(effect_ids)
      .options("--without", o->wanted.without, without_help)
      .offers(effect_ids)
      .flag("--yes", o->yes, "moves the motor without asking")
      .flag("--reset", o->reset, "arms the bench first; see that it is safe")
      .option("--reach", o->reach, "the share of the bench's reference that is used [0.9]")
      .option("--settle", o->settle, "[s] the motor takes to settle, and a slow meter for some readings [10]")
      .option("--rounds", o->rounds, "diagnoses at most [4]")
      .option("--seed", o->seed, "of the run that confirms [7]")
      .flag("--unchecked", o->unchecked, unchecked_help)
      .flag("--no-confirm", o->no_confirm, "leaves away the run that is predicted before it is made")
      .option("--out", o->folder, "folder for the model found and the prediction [investigation]")
      .option("--report", o->report, "writes a page of all rounds, the prediction and the diagnosis to this file")
      .option("--json", o->json_file, "writes all of it to this file; - for standard output")
      .action([o] { return investigate_command(*o); });
}

}  // namespace emtb
