#include "report/report_input.h"

#include <algorithm>
#include <ctime>

#include "emtb/version.h"
#include "session/gaps.h"
#include "session/spec.h"

namespace emtb {

ReportInput ReportInput::of(std::string model_file, Model given, std::string command) {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  gmtime_r(&now, &parts);
  char date[32];
  std::strftime(date, sizeof date, "%Y-%m-%d %H:%M UTC", &parts);
  return {.model_file = std::move(model_file),
          .model = std::move(given),
          .runs = {},
          .map_file = {},
          .candidates_file = {},
          .software = std::string("emtb ") + version + (*commit == 0 ? "" : std::string(", commit ") + commit),
          .date = date,
          .command = std::move(command),
          .on_figure = {},
          .investigation = nullptr};
}

void ReportInput::add(const std::string& spec, bool as_held_out, const Mapping& mapping) {
  const SessionSpec parsed = parse_session_spec(spec);
  const std::vector<Run> used = read_runs(spec, mapping);
  const bool cut = parsed.t0 || parsed.t1;
  const std::string source = parsed.path.string() + (parsed.run.empty() ? "" : "#" + parsed.run);
  const std::vector<Run> whole = cut ? read_runs(source, mapping) : used;
  for (std::size_t i = 0; i < used.size(); ++i) {
    const double end = whole.at(i).duration();
    runs.push_back(
        {spec, as_held_out, used[i], whole[i], parsed.t0.value_or(0), std::min(parsed.t1.value_or(end), end)});
  }
}

void ReportInput::split_at_gaps() {
  std::vector<ReportRun> pieces;
  for (const ReportRun& r : runs) {
    const std::vector<Gap> spans = spans_between_gaps(r.run, model.input);
    const std::vector<Run> parts = emtb::split_at_gaps(r.run, model.input);
    for (std::size_t i = 0; i < parts.size(); ++i) {
      pieces.push_back(r);
      pieces.back().run = parts[i];
      pieces.back().from = r.from + spans[i].from;
      pieces.back().to = std::min(r.to, r.from + spans[i].to);
    }
  }
  runs = std::move(pieces);
}

std::vector<Run> ReportInput::part(bool held_out) const {
  std::vector<Run> list;
  for (const ReportRun& r : runs)
    if (r.held_out == held_out) list.push_back(r.run);
  return list;
}

bool ReportInput::every_run_has(Signal signal) const {
  return std::ranges::all_of(runs, [&](const ReportRun& r) { return r.run.has(signal); });
}

bool ReportInput::some_run_has(Signal signal) const {
  return std::ranges::any_of(runs, [&](const ReportRun& r) { return r.run.has(signal); });
}

}  // namespace emtb
