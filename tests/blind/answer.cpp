#include "tests/blind/answer.h"

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>

#include "analysis/diagnose/diagnose.h"
#include "hal/error.h"
#include "model/catalogue.h"

namespace emtb::blind {
namespace {

using json = nlohmann::ordered_json;

double cpu_seconds() {
  rusage use{};
  getrusage(RUSAGE_SELF, &use);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(use.ru_utime) + seconds(use.ru_stime);
}

std::string id_of(std::size_t effect) { return std::string(effect_catalogue()[effect].id); }

bool among(const std::vector<std::string>& list, const std::string& id) {
  return std::ranges::find(list, id) != list.end();
}

void read_intervals(const Case& c, const Diagnosis& d, Answer& answer) {
  for (const MissingEffect& m : d.missing) {
    const auto truth = std::ranges::find(c.truths, id_of(m.effect), &Truth::id);
    if (truth == c.truths.end()) continue;
    for (const Parameter& p : m.parameters) {
      const auto known = std::ranges::find(truth->parameters, p.symbol, &TrueParameter::symbol);
      if (known == truth->parameters.end() || !p.std_error || p.fixed) continue;
      answer.intervals.push_back({truth->id + "." + p.symbol, known->value, p.value, *p.std_error});
    }
  }
  const auto& motor = c.bench.plant.motor;
  // Where K_m follows K_b although it is another, the shaft's constants come out larger by their ratio.
  const double scale = c.bench.model.tie.empty() ? 1 : motor.K_b / motor.K_m;
  const std::map<std::string, double> truths{
      {"R_a", motor.R_a}, {"K_b", motor.K_b}, {"B", scale * motor.B}, {"J", scale * motor.J}};
  for (const Parameter& p : d.final.base) {
    const auto known = truths.find(p.symbol);
    if (known != truths.end() && p.std_error)
      answer.base_intervals.push_back({p.symbol, known->second, p.value, *p.std_error});
  }
}

json to_json(const std::vector<Covered>& intervals) {
  json list = json::array();
  for (const Covered& c : intervals)
    list.push_back({c.name, c.truth, c.value, std::isfinite(c.std_error) ? json(c.std_error) : json(nullptr)});
  return list;
}

std::vector<Covered> intervals_from(const json& list) {
  std::vector<Covered> intervals;
  for (const json& c : list) {
    intervals.push_back({c.at(0), c.at(1), c.at(2), c.at(3).is_null() ? infinity : c.at(3).get<double>()});
  }
  return intervals;
}

double number(const json& value) { return value.is_null() ? std::nan("") : value.get<double>(); }

}  // namespace

Answer judge(const Case& c) {
  Answer answer;
  answer.id = c.id;
  answer.kind = name_of(c.kind);
  answer.bench = c.bench_kind == BenchKind::slow ? "slow" : "fast";
  answer.laws = c.bench.plant.laws == simulated::Laws::usual ? "usual" : "other";
  answer.nuisance = c.nuisance;
  answer.seed = c.seed;
  for (const Truth& t : c.truths) {
    answer.truth.push_back(t.id);
    answer.size.push_back(t.size);
    answer.right.push_back(t.right);
  }
  answer.tolerated = c.tolerated;
  answer.lacking = c.lacking;
  answer.given = c.given;
  answer.floor = c.floor;
  answer.linear_error = c.linear_error;

  const auto start = std::chrono::steady_clock::now();
  const double cpu = cpu_seconds();
  try {
    const Diagnosis d = diagnose(c.train, c.held_out, c.bench.model);
    answer.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    answer.cpu_seconds = cpu_seconds() - cpu;
    answer.verdict = word(d.verdict);
    answer.base = d.base_held_out;
    answer.unexplained = d.final_held_out;
    for (const MissingEffect& m : d.missing) {
      Answer::Named named{id_of(m.effect), {}};
      for (const std::size_t rival : m.tied_with) named.tied_with.push_back(id_of(rival));
      answer.missing.push_back(std::move(named));
    }
    for (const Candidate& candidate : d.candidates) {
      const Score& score = candidate.score;
      answer.candidates[id_of(score.effect)] = {candidate.held_out_error, score.predicted_drop, score.predicted_gain,
                                                score.visibility, score.p_value};
    }
    const auto squares = true_mean_squares(c, d.final);
    answer.final_error = error_of(squares) / c.floor;
    for (const auto& [signal, sigma] : true_sigma(c.bench)) {
      const auto used = d.signals.find(signal);
      if (used != d.signals.end())
        answer.sigma_ratio[std::string(info(signal).name)] = used->second.noise.sigma / sigma;
    }
    for (const auto& [signal, square] : squares) answer.signals[std::string(info(signal).name)] = std::sqrt(square);
    read_intervals(c, d, answer);
  } catch (const std::exception& error) {
    answer.verdict = std::string("failed: ") + error.what();
  }
  return answer;
}

std::string to_json_line(const Answer& a) {
  json missing = json::array();
  for (const Answer::Named& m : a.missing) missing.push_back({{"id", m.id}, {"tied_with", m.tied_with}});
  const auto finite = [](double value) { return std::isfinite(value) ? json(value) : json(nullptr); };
  json candidates = json::object();
  for (const auto& [id, c] : a.candidates) {
    candidates[id] = {{"held_out", c.held_out ? finite(*c.held_out) : json(nullptr)},
                      {"predicted_drop", finite(c.predicted_drop)},
                      {"predicted_gain", finite(c.predicted_gain)},
                      {"visibility", finite(c.visibility)},
                      {"p_value", finite(c.p_value)}};
  }
  const json line = {{"id", a.id},
                     {"kind", a.kind},
                     {"seed", a.seed},
                     {"bench", a.bench},
                     {"laws", a.laws},
                     {"nuisance", a.nuisance},
                     {"truth", a.truth},
                     {"size", a.size},
                     {"right", a.right},
                     {"tolerated", a.tolerated},
                     {"lacking", a.lacking},
                     {"given", a.given},
                     {"verdict", a.verdict},
                     {"missing", missing},
                     {"candidates", candidates},
                     {"base", finite(a.base)},
                     {"unexplained", finite(a.unexplained)},
                     {"floor", finite(a.floor)},
                     {"linear_error", finite(a.linear_error)},
                     {"final_error", finite(a.final_error)},
                     {"signals", a.signals},
                     {"sigma_ratio", a.sigma_ratio},
                     {"intervals", to_json(a.intervals)},
                     {"base_intervals", to_json(a.base_intervals)},
                     {"seconds", a.seconds},
                     {"cpu_seconds", a.cpu_seconds},
                     {"making_seconds", a.making_seconds}};
  return line.dump();
}

Answer answer_from(const std::string& line) try {
  const json j = json::parse(line);
  Answer a;
  a.id = j.at("id");
  a.kind = j.at("kind");
  a.seed = j.at("seed");
  a.bench = j.at("bench");
  a.laws = j.at("laws");
  a.nuisance = j.at("nuisance");
  a.truth = j.at("truth").get<std::vector<std::string>>();
  a.size = j.at("size").get<std::vector<double>>();
  a.right = j.at("right").get<std::vector<std::vector<std::string>>>();
  a.tolerated = j.at("tolerated").get<std::vector<std::string>>();
  a.lacking = j.at("lacking").get<std::vector<std::string>>();
  a.given = j.at("given").get<std::vector<std::string>>();
  a.verdict = j.at("verdict");
  for (const json& m : j.at("missing"))
    a.missing.push_back({m.at("id"), m.at("tied_with").get<std::vector<std::string>>()});
  for (const auto& [id, c] : j.at("candidates").items()) {
    Answer::Tried& tried = a.candidates[id];
    if (!c.at("held_out").is_null()) tried.held_out = c.at("held_out");
    tried.predicted_drop = number(c.at("predicted_drop"));
    tried.predicted_gain = number(c.at("predicted_gain"));
    tried.visibility = number(c.at("visibility"));
    tried.p_value = number(c.at("p_value"));
  }
  a.base = number(j.at("base"));
  a.unexplained = number(j.at("unexplained"));
  a.floor = number(j.at("floor"));
  a.linear_error = number(j.at("linear_error"));
  a.final_error = number(j.at("final_error"));
  for (const auto& [signal, error] : j.at("signals").items()) a.signals[signal] = number(error);
  for (const auto& [signal, ratio] : j.at("sigma_ratio").items()) a.sigma_ratio[signal] = number(ratio);
  a.intervals = intervals_from(j.at("intervals"));
  a.base_intervals = intervals_from(j.at("base_intervals"));
  a.seconds = j.at("seconds");
  a.cpu_seconds = j.at("cpu_seconds");
  a.making_seconds = j.at("making_seconds");
  return a;
} catch (const json::exception& error) {
  throw Error(std::string("no answer of a blind case: ") + error.what());
}

bool Grade::all_right() const {
  return wrong.empty() && std::ranges::all_of(found, [](bool f) { return f; });
}

bool Grade::any_found() const {
  return std::ranges::any_of(found, [](bool f) { return f; });
}

Grade grade(const Answer& answer) {
  constexpr std::size_t most_tied = 3;
  Grade g;
  g.found.resize(answer.truth.size());
  g.alone.resize(answer.truth.size());
  bool first = true;
  for (const Answer::Named& m : answer.missing) {
    const bool few = m.tied_with.size() < most_tied;
    const auto names = [&](const std::vector<std::string>& ids) {
      return among(ids, m.id) ||
             (few && std::ranges::any_of(m.tied_with, [&](const auto& id) { return among(ids, id); }));
    };
    std::optional<std::size_t> meant;
    for (std::size_t t = 0; t < answer.truth.size() && !meant; ++t) {
      if (!g.found[t] && names(answer.right[t])) meant = t;
    }
    if (meant) {
      const auto& right = answer.right[*meant];
      g.found[*meant] = true;
      g.alone[*meant] = (first || answer.truth.size() > 1) && among(right, m.id) &&
                        std::ranges::all_of(m.tied_with, [&](const auto& id) { return among(right, id); });
      first = false;
    } else if (!names(answer.tolerated)) {
      g.wrong.push_back(m.id);
      first = false;
    }
  }
  return g;
}

bool data_can_tell(const Answer& answer) {
  const auto refit = [&](const std::string& id) {
    const auto tried = answer.candidates.find(id);
    return tried == answer.candidates.end() ? std::nullopt : tried->second.held_out;
  };
  for (const std::string& truth : answer.truth) {
    const auto own = refit(truth);
    if (!own) continue;
    for (const Answer::Named& m : answer.missing) {
      std::vector<std::string> group = m.tied_with;
      group.push_back(m.id);
      if (!among(group, truth)) continue;
      for (const std::string& rival : group) {
        if (rival != truth && refit(rival).value_or(infinity) < 1.01 * *own) return false;
      }
    }
  }
  return true;
}

}  // namespace emtb::blind
