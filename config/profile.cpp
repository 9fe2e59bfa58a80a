#include "config/profile.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "config/profile_path.h"
#include "experiment/further_profiles.h"
#include "hal/one_line.h"
#include "hal/printable.h"
#include "session/spec.h"
#include "session/text.h"

namespace emtb {
namespace {

/// The rest around the experiment, which all kinds share.
struct Rest {
  double before;  ///< [s]
  double after;   ///< [s]
  double level;   ///< [V]
};

Rest rest(const YamlMap& yaml) {
  return {yaml.within("before", 0, unbounded), yaml.within("after", 0, unbounded), yaml.number_or("rest", 0)};
}

Profile read_step(const std::string& name, const YamlMap& yaml) {
  yaml.only({"name", "kind", "level", "before", "hold", "after", "rest", "needs", "pauses"});
  const auto [before, after, level] = rest(yaml);
  return step(name, yaml.number("level"), before, yaml.positive("hold"), after, level);
}

Profile read_ramp(const std::string& name, const YamlMap& yaml) {
  yaml.only({"name", "kind", "level", "rate", "before", "hold", "after", "rest", "needs", "pauses"});
  const auto [before, after, level] = rest(yaml);
  return ramp(name, yaml.number("level"), yaml.positive("rate"), before, yaml.within("hold", 0, unbounded), after,
              level);
}

Profile read_staircase(const std::string& name, const YamlMap& yaml) {
  yaml.only({"name", "kind", "levels", "before", "hold", "after", "rest", "needs", "pauses"});
  const auto [before, after, level] = rest(yaml);
  const std::vector<double> levels = yaml.numbers("levels");
  if (levels.empty()) yaml.fail("levels", "is empty. Give at least one level in V, e.g. [2, 4, 6]");
  return staircase(name, levels, before, yaml.positive("hold"), after, level);
}

Profile read_random_steps(const std::string& name, const YamlMap& yaml) {
  yaml.only({"name", "kind", "low", "high", "shortest", "longest", "total", "seed", "before", "after", "rest", "needs",
             "pauses"});
  const auto [before, after, level] = rest(yaml);
  const double low = yaml.number("low");
  const double high = yaml.within("high", low, unbounded);
  const double shortest = yaml.within("shortest", 1e-3, unbounded);  // [s] nothing on this bench follows faster
  const double longest = yaml.within("longest", shortest, unbounded);
  const double total = yaml.within("total", 0, most_levels * shortest);
  const double seed = yaml.within("seed", 0, 0x1p53);  // beyond 2^53 a double skips integers
  if (seed != static_cast<double>(static_cast<std::uint64_t>(seed))) yaml.fail("seed", "must be a whole number");
  return random_steps(name, low, high, shortest, longest, before, total, after, static_cast<std::uint64_t>(seed),
                      level);
}

Profile read_knots(const std::string& name, const YamlMap& yaml) {
  yaml.only({"name", "kind", "times", "values", "needs", "pauses"});
  const std::vector<double> times = yaml.numbers("times"), values = yaml.numbers("values");
  if (times.empty() || times.size() != values.size()) {
    yaml.fail("values", "has " + std::to_string(values.size()) + " entries, but times has " +
                            std::to_string(times.size()) + ". Give one value in V for each time in s");
  }
  std::vector<Knot> knots;
  for (std::size_t i = 0; i < times.size(); ++i) {
    if (times[i] < (i > 0 ? times[i - 1] : 0)) yaml.fail("times", "runs backwards, or begins before 0 s");
    knots.push_back({times[i], values[i]});
  }
  return {name, std::move(knots)};
}

Profile read_coast_down(const std::string& name, const YamlMap& yaml) {
  yaml.only({"name", "kind", "level", "rate", "before", "hold", "after", "rest", "needs", "pauses"});
  const auto [before, after, level] = rest(yaml);
  return coast_down(name, yaml.number("level"), yaml.positive("rate"), before, yaml.positive("hold"), after, level);
}

Profile read_reversal(const std::string& name, const YamlMap& yaml) {
  yaml.only({"name", "kind", "level", "times", "before", "hold", "after", "rest", "needs", "pauses"});
  const auto [before, after, level] = rest(yaml);
  const double times = yaml.within_or("times", 1, 1000, 1);
  if (times != std::floor(times)) yaml.fail("times", "must be a whole number");
  return reversal(name, yaml.number("level"), static_cast<int>(times), before, yaml.positive("hold"), after, level);
}

Profile read_chirp(const std::string& name, const YamlMap& yaml) {
  yaml.only({"name", "kind", "offset", "amplitude", "f0", "f1", "before", "total", "after", "rest", "needs", "pauses"});
  const auto [before, after, level] = rest(yaml);
  return chirp(name, yaml.number("offset"), yaml.positive("amplitude"), yaml.positive("f0"), yaml.positive("f1"),
               before, yaml.positive("total"), after, level);
}

Profile read_heat_soak(const std::string& name, const YamlMap& yaml) {
  yaml.only({"name", "kind", "level", "low", "every", "dip", "before", "total", "after", "rest", "needs", "pauses"});
  const auto [before, after, level] = rest(yaml);
  return heat_soak(name, yaml.number("level"), yaml.number("low"), yaml.positive("every"), yaml.positive("dip"), before,
                   yaml.positive("total"), after, level);
}

/// The u_ref of a session; each value is held until the next, as a daemon set it, unless `line: true` asks for straight
/// lines.
Profile read_from_csv(const std::string& name, const YamlMap& yaml) {
  yaml.only({"name", "kind", "file", "line", "needs", "pauses"});
  const std::filesystem::path file(yaml.text("file"));
  if (printable(file.string()) != file.string()) yaml.fail("file", "holds a control character");
  const auto runs = read_runs((yaml.file().parent_path() / file).string());
  if (runs.size() != 1 || !runs[0].has(Signal::u_ref)) {
    yaml.fail("file", "must name one run with a column u_ref_V: PATH[#RUN]");
  }
  const Series& u = runs[0].at(Signal::u_ref);
  if (!yaml.flag_or("line", false)) return held(name, u.t, u.value);
  std::vector<Knot> knots;
  for (std::size_t i = 0; i < u.t.size(); ++i) knots.push_back({u.t[i], u.value[i]});
  return {name, std::move(knots)};
}

Needs read_needs(const YamlMap& yaml) {
  const auto entry = yaml.map_if("needs");
  if (!entry) return {};
  entry->only({"at_rest", "field", "idle", "temperature"});
  Needs needs{.at_rest = entry->flag_or("at_rest", false), .field = entry->flag_or("field", false)};
  if (entry->has("idle")) needs.idle = entry->within("idle", 0, unbounded);
  if (entry->has("temperature")) needs.temperature = entry->number("temperature");
  return needs;
}

std::vector<Pause> read_pauses(const YamlMap& yaml, double duration) {
  std::vector<Pause> pauses;
  for (const YamlMap& entry : yaml.maps("pauses")) {
    entry.only({"at", "say", "within"});
    const double earliest = pauses.empty() ? 0 : pauses.back().at;
    pauses.push_back({.at = entry.within("at", earliest, duration),
                      .say = in_one_line(entry.text("say")),
                      .within = entry.within_or("within", 1, 3600, 60)});
  }
  return pauses;
}

using Reader = Profile (*)(const std::string&, const YamlMap&);
constexpr std::array<std::pair<std::string_view, Reader>, 10> kinds{{{"step", read_step},
                                                                     {"coast_down", read_coast_down},
                                                                     {"reversal", read_reversal},
                                                                     {"chirp", read_chirp},
                                                                     {"heat_soak", read_heat_soak},
                                                                     {"from_csv", read_from_csv},
                                                                     {"ramp", read_ramp},
                                                                     {"staircase", read_staircase},
                                                                     {"random_steps", read_random_steps},
                                                                     {"knots", read_knots}}};

}  // namespace

Profile read_profile(const std::filesystem::path& path) { return read_profile(YamlMap::load(path)); }

Profile read_profile(const YamlMap& yaml) {
  const std::string name = yaml.text("name");
  if (!is_profile_name(name)) {
    yaml.fail("name", "is `" + name + "`, but may only have letters, digits, _ and -");
  }
  const std::string kind = yaml.text("kind");
  for (const auto& [word, read] : kinds) {
    if (word == kind) return read(name, yaml);
  }
  yaml.fail(
      "kind",
      "is `" + kind +
          "`. Known: step, ramp, staircase, random_steps, knots, coast_down, reversal, chirp, heat_soak, from_csv");
}

Experiment read_experiment(const std::filesystem::path& path) { return read_experiment(YamlMap::load(path)); }

Experiment read_experiment(const YamlMap& yaml) {
  Profile profile = read_profile(yaml);
  std::vector<Pause> pauses = read_pauses(yaml, profile.duration());
  return {.profile = std::move(profile), .needs = read_needs(yaml), .pauses = std::move(pauses)};
}

std::string self_contained(const YamlMap& yaml) {
  std::string text = to_yaml(read_experiment(yaml).profile);
  for (const char* key : {"needs", "pauses"}) {
    if (!yaml.has(key)) continue;
    YAML::Node entry = YAML::Clone(yaml.node()[key]);
    entry.SetStyle(YAML::EmitterStyle::Flow);
    text += std::string(key) + ": " + YAML::Dump(entry) + "\n";
  }
  return text;
}

std::string to_yaml(const Profile& profile) {
  std::string times, values;
  for (const Knot& knot : profile.knots()) {
    const char* const comma = times.empty() ? "" : ", ";
    times += comma + shortest(knot.t);
    values += comma + shortest(knot.value);
  }
  return "name: " + profile.name() + "\nkind: knots\ntimes: [" + times + "]   # [s]\nvalues: [" + values + "]  # [V]\n";
}

}  // namespace emtb
