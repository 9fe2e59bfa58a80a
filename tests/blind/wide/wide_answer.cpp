#include "tests/blind/wide/wide_answer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "hal/error.h"

namespace emtb::blind::wide {
namespace {

using json = nlohmann::ordered_json;

json finite(double value) { return std::isfinite(value) ? json(value) : json(nullptr); }

json to_json(const std::vector<Covered>& list) {
  json out = json::array();
  for (const Covered& c : list) out.push_back({c.name, c.truth, c.value, c.std_error});
  return out;
}

std::vector<Covered> covered_from(const json& list) {
  std::vector<Covered> out;
  for (const json& c : list) out.push_back({c.at(0), c.at(1), c.at(2), c.at(3)});
  return out;
}

double number(const json& j) { return j.is_null() ? std::nan("") : j.get<double>(); }

bool starts_with(const std::string& text, const std::string& start) { return text.rfind(start, 0) == 0; }

}  // namespace

std::string to_json_line(const WideAnswer& a) {
  json missing = json::array();
  for (const auto& m : a.missing) missing.push_back({{"id", m.id}, {"tied_with", m.tied_with}});
  json secret = json::object();
  for (const auto& [signal, error] : a.secret) secret[signal] = finite(error);
  const json line = {{"id", a.id},
                     {"kind", a.kind},
                     {"seed", a.seed},
                     {"checksum", a.checksum},
                     {"traits", a.traits},
                     {"truth", a.truth},
                     {"size", a.size},
                     {"right", a.right},
                     {"tolerated", a.tolerated},
                     {"lacking", a.lacking},
                     {"visible", finite(a.visible)},
                     {"verdict", a.verdict},
                     {"missing", missing},
                     {"base", finite(a.base)},
                     {"unexplained", finite(a.unexplained)},
                     {"seconds", a.seconds},
                     {"intervals", to_json(a.intervals)},
                     {"base_intervals", to_json(a.base_intervals)},
                     {"secret", secret},
                     {"nats", a.nats ? finite(*a.nats) : json(nullptr)},
                     {"truth_error", finite(a.truth_error)},
                     {"rival", a.rival},
                     {"why_not", a.why_not},
                     {"findings", a.findings ? json(*a.findings) : json(nullptr)},
                     {"garbage", a.garbage},
                     {"garbage_how", a.garbage_how},
                     {"contradicted", a.contradicted},
                     {"stopped", a.stopped}};
  return line.dump();
}

WideAnswer wide_answer_from(const std::string& line) try {
  const json j = json::parse(line);
  WideAnswer a;
  a.id = j.at("id");
  a.kind = j.at("kind");
  a.seed = j.at("seed");
  a.checksum = j.at("checksum");
  a.traits = j.at("traits").get<std::map<std::string, std::string>>();
  a.truth = j.at("truth").get<std::vector<std::string>>();
  a.size = j.at("size").get<std::vector<double>>();
  a.right = j.at("right").get<std::vector<std::vector<std::string>>>();
  a.tolerated = j.at("tolerated").get<std::vector<std::string>>();
  a.lacking = j.at("lacking").get<std::vector<std::string>>();
  a.visible = number(j.at("visible"));
  a.verdict = j.at("verdict");
  for (const json& m : j.at("missing")) {
    a.missing.push_back({m.at("id"), m.at("tied_with").get<std::vector<std::string>>()});
  }
  a.base = number(j.at("base"));
  a.unexplained = number(j.at("unexplained"));
  a.seconds = j.at("seconds");
  a.intervals = covered_from(j.at("intervals"));
  a.base_intervals = covered_from(j.at("base_intervals"));
  for (const auto& [signal, error] : j.at("secret").items()) a.secret[signal] = number(error);
  if (!j.at("nats").is_null()) a.nats = j.at("nats");
  a.truth_error = number(j.at("truth_error"));
  a.rival = j.at("rival");
  a.why_not = j.at("why_not");
  if (!j.at("findings").is_null()) a.findings = j.at("findings").get<std::vector<std::string>>();
  a.garbage = j.at("garbage");
  a.garbage_how = j.at("garbage_how");
  a.contradicted = j.at("contradicted");
  a.stopped = j.at("stopped");
  return a;
} catch (const json::exception& error) {
  throw Error(std::string("no answer of a wide case: ") + error.what());
}

Grade grade(const WideAnswer& answer) {
  Answer a;
  a.truth = answer.truth;
  a.right = answer.right;
  a.tolerated = answer.tolerated;
  a.missing = answer.missing;
  return blind::grade(a);
}

bool counts(const WideAnswer& a) { return !starts_with(a.verdict, "not made") && a.lacking.empty(); }

bool undecidable(const WideAnswer& a) {
  const auto is = [&](const char* trait, const char* value) {
    const auto found = a.traits.find(trait);
    return found != a.traits.end() && found->second == value;
  };
  if (a.truth_error > 2 && is("laws", "usual") && is("model error", "no")) return false;
  return counts(a) && !a.truth.empty() && a.kind != "outside" && !grade(a).all_right() && a.nats && *a.nats < 3;
}

bool missed(const WideAnswer& a) {
  if (!counts(a) || a.kind == "garbage") return false;
  if (starts_with(a.verdict, "failed")) return true;
  const Grade g = grade(a);
  if (a.kind == "healthy") return !g.wrong.empty() || a.verdict == "unknown_effect";
  if (a.kind == "outside") return !g.wrong.empty() && !states_remainder(a);
  return !g.all_right() && !undecidable(a);
}

bool states_remainder(const WideAnswer& a) { return a.verdict == "unknown_effect" || a.unexplained > 1.25; }

std::vector<std::string> false_findings(const WideAnswer& a) {
  // A remark is no finding that something is wrong: jitter, delay, resolution and rest are true of healthy data, too.
  constexpr std::array<std::string_view, 7> wrong{"scale", "sign",        "clipped",  "spikes",
                                                  "gap",   "angle_speed", "duplicate"};
  std::vector<std::string> list;
  const auto trait = a.traits.find("hold");
  const bool holds = trait != a.traits.end() && trait->second == "yes";
  for (const std::string& finding : a.findings.value_or(std::vector<std::string>{})) {
    const std::string what = finding.substr(0, finding.find(' '));
    if (what == a.garbage) continue;
    if (std::ranges::find(wrong, what) != wrong.end() || (what == "held" && !holds)) list.push_back(finding);
  }
  return list;
}

}  // namespace emtb::blind::wide
