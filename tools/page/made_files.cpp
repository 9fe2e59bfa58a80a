#include "tools/page/made_files.h"

#include <algorithm>
#include <cmath>
#include <fstream>

#include "config/mapping.h"
#include "hal/error.h"
#include "hal/printable.h"
#include "report/text.h"
#include "server/rpc.h"
#include "session/csv.h"
#include "session/spec.h"
#include "session/units.h"
#include "tools/page/numbers.h"

namespace emtb::page {
namespace {

constexpr std::size_t rows_shown = 6;
constexpr double longest_run = 1e9;  // [s]

/// A name in the folder that no file has: `steps.h5`, `steps-2.h5` ...
std::filesystem::path free_name(const std::filesystem::path& folder, const std::string& stem,
                                const std::string& ending) {
  std::filesystem::create_directories(folder);
  std::filesystem::path path = folder / (stem + ending);
  for (int n = 2; std::filesystem::exists(path); ++n) path = folder / (stem + "-" + std::to_string(n) + ending);
  return path;
}

json made(const Files& files, const std::string& stem, const Session& session) {
  const auto path = free_name(files.imports(), stem, ".h5");
  write_session(path, session);
  return {{"path", std::filesystem::canonical(path).string()}, {"name", path.filename().string()}};
}

void add_note(Session& session, const std::string& what) {
  std::string& note = session.attributes["note"];
  note += (note.empty() ? "" : "; ") + what;
}

/// Leaves the run of that name. @throws Error where there is none
void keep_run(Session& session, const std::string& name) {
  std::erase_if(session.runs, [&](const Run& run) { return run.name != name; });
  if (session.runs.empty()) throw Error("the session has no run " + printable(name));
}

json column_json(const CsvHead::Column& column) {
  return {{"name", column.name},
          {"cells", column.cells},
          {"time", column.is_time},
          {"signal", column.signal ? json(info(*column.signal).name) : json(nullptr)},
          {"unit", column.unit}};
}

json signal_json(Signal signal) {
  json units = json::array();
  const std::string known = known_units(signal);
  for (std::size_t at = 0; at < known.size();) {
    const std::size_t end = std::min(known.size(), known.find(", ", at));
    units.push_back(known.substr(at, end - at));
    at = end + 2;
  }
  return {{"name", info(signal).name}, {"meaning", info(signal).meaning}, {"units", units}};
}

}  // namespace

json cut_session(const json& params, const Files& files, const Recordings& recordings, const Mapping& mapping) {
  const rpc::Params given(params);
  const auto file = recordings.checked(given.text("path"));
  Session session = read_session(file, mapping);
  if (params.contains("run")) keep_run(session, given.text("run"));
  const double from = given.number_or("from", 0, 0, longest_run),
               to = given.number_or("to", longest_run, 0, longest_run);
  double end = 0;
  for (Run& run : session.runs) {
    end = std::max(end, std::min(to, run.duration()));
    run = cut(run, from, to > run.duration() ? HUGE_VAL : to);  // the last reading is at its end
  }
  std::erase_if(session.runs, [](const Run& run) { return run.signals.empty(); });
  if (session.runs.empty()) {
    throw Error("there is no reading from " + pretty(from, 6) + " to " + pretty(to, 6) + " s");
  }
  session.events.clear();  // they are of the whole, by its clock
  const std::string part = pretty(from, 6) + " to " + pretty(end, 6) + " s";
  add_note(session, part + " of " + file.filename().string());
  return made(files, file.stem().string() + "_" + pretty(from, 6) + "-" + pretty(end, 6) + "s", session);
}

json csv_columns(const json& params, const Recordings& recordings) {
  const auto file = recordings.checked(rpc::Params(params).text("path"));
  const CsvHead head = read_csv_head(file, rows_shown);
  json columns = json::array(), signals = json::array();
  for (const CsvHead::Column& column : head.columns) columns.push_back(column_json(column));
  for (const Signal signal : all_signals()) signals.push_back(signal_json(signal));
  return {{"columns", columns}, {"signals", signals}, {"time_units", {"s", "ms", "us", "min", "h"}}};
}

json map_csv(const json& params, const Files& files, const Recordings& recordings) {
  const rpc::Params given(params);
  const auto file = recordings.checked(given.text("path"));
  const std::string text = given.text("map");
  if (file.extension() != ".csv") throw Error(file.filename().string() + ": a mapping is of a .csv");
  Session session = read_session(file, read_mapping(YamlMap::parse(text, "the mapping")));
  add_note(session, "from " + file.filename().string());
  const json answer = made(files, file.stem().string(), session);
  std::error_code error;
  if (!std::filesystem::equivalent(file.parent_path(), files.imports(), error)) return answer;
  const auto raw = free_name(files.imports() / "raw", file.stem().string(), ".csv");
  std::filesystem::rename(file, raw);
  std::ofstream(std::filesystem::path(raw).replace_extension(".yaml")) << text;
  return answer;
}

}  // namespace emtb::page
