#include "config/profile.h"

#include <algorithm>
#include <array>
#include <sstream>

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
  yaml.only({"name", "kind", "level", "before", "hold", "after", "rest"});
  const auto [before, after, level] = rest(yaml);
  return step(name, yaml.number("level"), before, yaml.positive("hold"), after, level);
}

Profile read_ramp(const std::string& name, const YamlMap& yaml) {
  yaml.only({"name", "kind", "level", "rate", "before", "hold", "after", "rest"});
  const auto [before, after, level] = rest(yaml);
  return ramp(name, yaml.number("level"), yaml.positive("rate"), before, yaml.within("hold", 0, unbounded), after,
              level);
}

Profile read_staircase(const std::string& name, const YamlMap& yaml) {
  yaml.only({"name", "kind", "levels", "before", "hold", "after", "rest"});
  const auto [before, after, level] = rest(yaml);
  const std::vector<double> levels = yaml.numbers("levels");
  if (levels.empty()) yaml.fail("levels", "is empty. Give at least one level in V, e.g. [2, 4, 6]");
  return staircase(name, levels, before, yaml.positive("hold"), after, level);
}

Profile read_random_steps(const std::string& name, const YamlMap& yaml) {
  yaml.only({"name", "kind", "low", "high", "shortest", "longest", "total", "seed", "before", "after", "rest"});
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
  yaml.only({"name", "kind", "times", "values"});
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

using Reader = Profile (*)(const std::string&, const YamlMap&);
constexpr std::array<std::pair<std::string_view, Reader>, 5> kinds{{{"step", read_step},
                                                                    {"ramp", read_ramp},
                                                                    {"staircase", read_staircase},
                                                                    {"random_steps", read_random_steps},
                                                                    {"knots", read_knots}}};

}  // namespace

Profile read_profile(const std::filesystem::path& path) { return read_profile(YamlMap::load(path)); }

Profile read_profile(const YamlMap& yaml) {
  const std::string name = yaml.text("name");
  // The name becomes part of a file name: the session's.
  const auto harmless = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  };
  if (name.empty() || !std::ranges::all_of(name, harmless)) {
    yaml.fail("name", "is `" + name + "`, but may only have letters, digits, _ and -");
  }
  const std::string kind = yaml.text("kind");
  for (const auto& [word, read] : kinds) {
    if (word == kind) return read(name, yaml);
  }
  yaml.fail("kind", "is `" + kind + "`. Known: step, ramp, staircase, random_steps, knots");
}

std::string to_yaml(const Profile& profile) {
  std::ostringstream times, values;
  times.precision(17);
  values.precision(17);
  for (const Knot& knot : profile.knots()) {
    const char* const comma = &knot == profile.knots().data() ? "" : ", ";
    times << comma << knot.t;
    values << comma << knot.value;
  }
  return "name: " + profile.name() + "\nkind: knots\ntimes: [" + times.str() + "]   # [s]\nvalues: [" + values.str() +
         "]  # [V]\n";
}

}  // namespace emtb
