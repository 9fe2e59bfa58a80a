#include "tests/blind/wide/asking.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/blind/wide/command.h"
#include "tests/blind/wide/oracle.h"

namespace emtb::blind::wide {
namespace {

using json = nlohmann::json;

json read_json(const std::filesystem::path& file) {
  std::ifstream in(file);
  return json::parse(in);
}

double number(const json& j, const char* key) {
  const auto found = j.find(key);
  return found == j.end() || found->is_null() ? std::nan("") : found->get<double>();
}

/// A value that is said to be right only as far as that of a parameter that is held. A B that is held adds to the rest,
/// and the error counts what it may be; the others are factors.
bool goes_with_another(const json& p) {
  const auto with = p.find("scaled_with");
  return with != p.end() && std::ranges::any_of(*with, [](const json& name) { return name != "B"; });
}

/// An estimate with an error of its own; nothing where it is pinned, goes with what is, is held or not determined.
void add_interval(std::vector<Covered>& list, const std::string& name, double truth, const json& p) {
  const bool pinned = p.contains("pinned") && p["pinned"].is_boolean() && p["pinned"].get<bool>();
  const double error = number(p, "std_error"), value = number(p, "value");
  if (pinned || goes_with_another(p) || !(error > 0) || !std::isfinite(value)) return;
  list.push_back({name, truth, value, error});
}

void read_intervals(const WideCase& c, const json& result, WideAnswer& answer) {
  for (const json& m : result.at("missing")) {
    const auto truth = std::ranges::find(c.truths, m.at("id").get<std::string>(), &Truth::id);
    if (truth == c.truths.end()) continue;
    for (const TrueParameter& p : truth->parameters) {
      const json& all = m.at("parameters");
      if (all.contains(p.symbol)) add_interval(answer.intervals, truth->id + "." + p.symbol, p.value, all.at(p.symbol));
    }
  }
  for (const auto& [symbol, value] : true_base(c)) {
    const json& all = result.at("parameters");
    if (all.contains(symbol)) add_interval(answer.base_intervals, symbol, value, all.at(symbol));
  }
}

void read_diagnosis(const WideCase& c, const CaseFiles& files, WideAnswer& answer) {
  const json result = read_json(files.folder / "diagnosis.json");
  answer.verdict = result.at("verdict");
  for (const json& m : result.at("missing")) {
    answer.missing.push_back({m.at("id"), m.at("tied_with").get<std::vector<std::string>>()});
  }
  const json& error = result.at("error");
  const auto held_out = [](const json& e) {
    const double value = number(e, "held_out");
    return std::isfinite(value) ? value : number(e, "train");
  };
  answer.base = held_out(error.at("base"));
  answer.unexplained = held_out(error.at("final"));
  read_intervals(c, result, answer);
  try {
    answer.secret = secret_errors(c, files, "final.yaml");
  } catch (const std::exception&) {
    answer.secret.clear();  // a model file that this library cannot read: written by another version
  }
}

void diagnose(const WideCase& c, const CaseFiles& files, const Asking& how, WideAnswer& answer) {
  std::ofstream(files.folder / "command.txt") << as_typed("emtb", diagnose_arguments(files)) << "\n";
  const Ended ended = run_command(how.emtb, diagnose_arguments(files), files.folder, "diagnosis.log", how.longest);
  answer.seconds = ended.seconds;
  if (!ended.in_time) {
    answer.verdict = "failed: no answer in time";
  } else if (!std::filesystem::exists(files.folder / "diagnosis.json")) {
    answer.stopped = ended.code == 1;
    answer.verdict = "failed: exit " + std::to_string(ended.code) + ", " + ended.last_line;
  } else {
    read_diagnosis(c, files, answer);
  }
}

std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::ostringstream out;
  out << in.rdbuf();
  return out.str();
}

/// `emtb check` on all files; with the model where the command takes one: its bounds and priors are witnesses, too.
void check(const CaseFiles& files, const Asking& how, WideAnswer& answer) {
  if (!has_check(how.emtb, files.folder)) return;
  std::vector<std::string> arguments{"check"};
  arguments.insert(arguments.end(), files.train.begin(), files.train.end());
  arguments.insert(arguments.end(), files.held_out.begin(), files.held_out.end());
  if (text_of(files.folder / "help.log").find("--model") != std::string::npos) {
    arguments.insert(arguments.end(), {"--model", files.model});
  }
  arguments.insert(arguments.end(), {"--json", "check.json"});
  run_command(how.emtb, arguments, files.folder, "check.log", how.longest);
  answer.findings.emplace();
  if (!std::filesystem::exists(files.folder / "check.json")) return;
  const json result = read_json(files.folder / "check.json");
  for (const json& finding : result.at("findings")) {
    const auto word = [&](const char* key) {
      return finding.contains(key) && finding[key].is_string() ? finding[key].get<std::string>() : std::string();
    };
    answer.findings->push_back(word("what") + " " + word("signal") + " " + word("run"));
  }
}

}  // namespace

std::vector<std::string> diagnose_arguments(const CaseFiles& files) {
  std::vector<std::string> list{"diagnose"};
  const auto more = files.arguments();
  list.insert(list.end(), more.begin(), more.end());
  list.insert(list.end(), {"--json", "diagnosis.json", "--out", "final.yaml"});
  return list;
}

bool has_check(const std::filesystem::path& emtb, const std::filesystem::path& folder) {
  // A program that does not know the command prints its general help.
  return run_command(emtb, {"check", "--help"}, folder, "help.log", 20).code == 0 &&
         text_of(folder / "help.log").find("emtb check") != std::string::npos;
}

WideAnswer answer_not_made(Kind kind, std::size_t number, const std::string& why) {
  WideAnswer a;
  a.kind = name_of(kind);
  a.id = a.kind + ":" + std::to_string(number);
  a.verdict = why;
  return a;
}

WideAnswer ask(const WideCase& c, const CaseFiles& files, const Asking& how) {
  WideAnswer a;
  a.id = c.id;
  a.kind = name_of(c.kind);
  a.seed = c.seed;
  a.checksum = files.checksum;
  a.traits = c.bench.traits;
  a.visible = c.visible;
  for (const Truth& t : c.truths) {
    a.truth.push_back(t.id);
    a.size.push_back(t.size);
    a.right.push_back(t.right);
    if (!wide_effect(t.id).outside && !in_library(t.id)) a.lacking.push_back(t.id);
  }
  // What loads a bench with a gauge is read by it: an input, of which nothing need be said.
  if (c.bench.find(Signal::torque) != nullptr)
    a.tolerated = {c.bench.plant.load.brake > 0 ? "dry_brake" : "eddy_brake"};
  // Its dry friction holds by a bristle, however little that gives, and so does a brake by its lining: a fast, fine
  // encoder sees it.
  const bool bristle = c.bench.plant.friction.law == simulated::FrictionLaw::bristle;
  if (bristle || c.bench.plant.load.brake > 0) a.tolerated.emplace_back("presliding_friction");
  for (const char* old : {"diagnosis.json", "final.yaml", "check.json"}) std::filesystem::remove(files.folder / old);
  check(files, how, a);
  if (c.garbage) {
    a.garbage = c.garbage->what;
    a.garbage_how = c.garbage->how;
    a.contradicted = c.garbage->contradicted;
    if (!a.findings)
      a.verdict = "skipped: this emtb has no `check`";
    else
      a.verdict = "checked";
    return a;
  }
  diagnose(c, files, how, a);
  const bool hides = c.kind == Kind::single || c.kind == Kind::pair || c.kind == Kind::triple;
  if (how.oracle && hides && !a.verdict.starts_with("failed") && !grade(a).all_right() && a.lacking.empty()) {
    std::vector<std::string> named;
    for (const auto& m : a.missing) named.push_back(m.id);
    const Oracle oracle = ask_oracle(c, files, named);
    a.nats = oracle.nats;
    a.truth_error = oracle.truth_error;
    a.rival = oracle.rival;
    a.why_not = oracle.why_not;
  }
  return a;
}

}  // namespace emtb::blind::wide
