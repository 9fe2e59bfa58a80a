#include "report/findings.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "report/text.h"
#include "session/spec.h"

namespace emtb {
namespace {

using json = nlohmann::ordered_json;

/// What a run's name says of file and run.
std::pair<json, json> place_of(const std::string& name) {
  if (name.empty()) return {nullptr, nullptr};
  try {
    const SessionSpec spec = parse_session_spec(name);
    return {spec.path.string(), spec.run};
  } catch (const std::exception&) {  // a run that was not read of a file
    return {name, ""};
  }
}

bool alike(const DataFinding& a, const DataFinding& b) {
  return a.signal == b.signal && a.what == b.what && a.stops == b.stops;
}

}  // namespace

std::vector<std::string> lines_of(const DataFindings& findings) {
  std::vector<std::string> lines;
  std::vector<bool> told(findings.size(), false);
  for (std::size_t k = 0; k < findings.size(); ++k) {
    if (told[k]) continue;
    const DataFinding& f = findings[k];
    std::size_t more = 0;
    for (std::size_t m = k + 1; m < findings.size(); ++m) {
      if (f.what == Flaw::duplicate || !alike(f, findings[m])) continue;
      told[m] = true;
      ++more;
    }
    const bool part = f.to > f.from && f.what != Flaw::scale && f.what != Flaw::sign && f.what != Flaw::duplicate;
    std::string line = f.run.empty() ? std::string("all runs") : f.run;
    if (part) line += ", " + pretty(f.from, 5) + " to " + pretty(f.to, 5) + " s";
    line += ": " + std::string(name_of(f.what)) + ": " + f.text;
    if (more > 0) line += " (and in " + std::to_string(more) + (more == 1 ? " other run)" : " other runs)");
    lines.push_back(line);
  }
  return lines;
}

std::string why_nothing_is_fitted(const DataFindings& findings) {
  const auto any = [&](bool by_bounds) {
    return std::ranges::any_of(findings, [&](const DataFinding& f) { return f.stops && f.by_bounds == by_bounds; });
  };
  if (!any(true)) return "these recordings contradict themselves. Mend them, or add --unchecked";
  const std::string mend = "Mend them, or widen the bounds in the model's file, or add --unchecked";
  return (any(false) ? "these recordings contradict themselves and the model's bounds. "
                     : "these recordings contradict the model's bounds. ") +
         mend;
}

json to_json(const DataFindings& findings) {
  json list = json::array();
  for (const DataFinding& f : findings) {
    const auto [session, run] = place_of(f.run);
    list.push_back({{"session", session},
                    {"run", run},
                    {"signal", f.signal ? json(std::string(info(*f.signal).name)) : json(nullptr)},
                    {"what", std::string(name_of(f.what))},
                    {"from_s", f.from},
                    {"to_s", f.to},
                    {"text", f.text},
                    {"stops", f.stops}});
  }
  return {{"findings", list}};
}

}  // namespace emtb
