#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>

#include "analysis/record/log_alignment.h"
#include "config/mapping.h"
#include "config/model.h"
#include "config/profile.h"
#include "config/profile_path.h"
#include "figures/terminal.h"
#include "hal/error.h"
#include "hal/printable.h"
#include "hal/unit.h"
#include "model/simulation.h"
#include "report/result_json.h"
#include "report/text.h"
#include "session/mat.h"
#include "session/spec.h"
#include "tools/commands.h"
#include "tools/offered_words.h"
#include "tools/prediction.h"

namespace emtb {
namespace {

using json = nlohmann::ordered_json;

struct FileOptions {
  std::string model, profile, map, out, json_file, truth, log, mat = "5";
  std::vector<std::string> sessions, models;
  double rate = 1000;  ///< [Hz]

  Mapping mapping() const { return map.empty() ? Mapping{} : read_mapping(map); }

  std::vector<Run> runs() const { return read_runs(sessions, mapping()); }
};

/// The reference of a profile, sampled as the loop would set it, through driver, motor and sensors in a row.
int simulate_command(const FileOptions& o) {
  const Model model = read_model(o.model);
  const Profile profile = read_profile(profile_path(o.profile));
  if (!(o.rate >= 10 && o.rate <= 1e5)) throw Error("--rate must be 10 to 100000 Hz");
  if (o.out.empty()) throw Error("simulate needs --out FILE, .csv, .h5 or .mat: where the simulated session goes");
  write_session(o.out, prediction(model, profile, o.rate));
  std::cout << o.out << "\n";
  return 0;
}

/// The log of a meter's own software, by its own clock, becomes i_a of a recorded run.
int merge_log(const FileOptions& o) {
  const SessionSpec spec = parse_session_spec(o.sessions.front());
  Session session = read_session(spec.path);
  session.runs = read_runs(o.sessions.front());
  if (session.runs.size() != 1) throw Error(o.sessions.front() + ": has several runs. Name the log's: PATH#RUN");
  Run& run = session.runs.front();
  if (run.has(Signal::i_a)) throw Error(run.name + ": has an i_a already. A log may only add one");
  const Session logged = read_session(o.log, o.mapping());
  if (logged.runs.size() != 1 || !logged.runs.front().has(Signal::i_a)) {
    throw Error(o.log + ": gives no i_a of one run. Say with --map which column it is, and the meter's window");
  }
  const Series& log = logged.runs.front().at(Signal::i_a);
  const LogAlignment at = align_log(run, log);
  Series series = placed(run, log, at);
  series.source = "log " + o.log;
  std::string how = std::to_string(series.t.size()) + " of " + std::to_string(log.t.size()) +
                    " readings of the log: its clock plus " + pretty(at.offset, 6) + " +- " +
                    pretty(at.offset_error, 2) + " s";
  how += at.drift_error > 0
             ? ", slow by " + pretty(1e6 * at.drift, 3) + " +- " + pretty(1e6 * at.drift_error, 2) + " ppm"
             : ", too short to tell a drift";
  how += "; explained " + pretty(100 * at.explained, 3) + " %, at the best other place " +
         pretty(100 * at.runner_up, 3) + " %";
  run.signals[Signal::i_a] = std::move(series);
  std::string& note = session.attributes["note"];
  note += (note.empty() ? "" : "; ") + ("i_a from " + o.log + ", " + how);
  write_session(o.out, session);
  std::cout << how << "\n" << o.out << "\n";
  return 0;
}

/// By the ending; of a .mat also by its version.
void write(const FileOptions& o, const Session& session) {
  if (o.mat == "7.3") {
    if (!o.out.ends_with(".mat")) throw Error("--mat 7.3 is for --out FILE.mat");
    return write_mat(o.out, session, MatVersion::v73);
  }
  write_session(o.out, session);
}

int convert_command(const FileOptions& o) {
  if (o.sessions.size() != 1) throw Error("one SESSION at a time");
  if (o.out.empty()) throw Error("--out FILE is missing: where the session goes, .csv, .h5 or .mat");
  if (!o.log.empty()) return merge_log(o);
  Session session;
  const SessionSpec spec = parse_session_spec(o.sessions.front());
  if (spec.run.empty() && !spec.t0 && !spec.t1) {
    session = read_session(spec.path, o.mapping());
  } else {
    session.runs = o.runs();
    session.attributes["note"] = "cut from " + o.sessions.front();
  }
  write(o, session);
  std::cout << o.out << "\n";
  return 0;
}

int info_command(const FileOptions& o) {
  json all = json::array();
  for (const std::string& text : o.sessions) {
    const SessionSpec spec = parse_session_spec(text);
    const Session session = read_session(spec.path, o.mapping());
    json one{{"session", text}, {"complete", session.complete}, {"attributes", session.attributes}};
    std::cout << text << (session.complete ? "" : "  (incomplete: the recording ended abruptly)") << "\n";
    for (const auto& [key, value] : session.attributes)
      std::cout << fitted("  " + printable(key) + ": " + printable(value), width_of_rows());
    one["runs"] = json::array();
    for (const Run& run : read_runs(text, o.mapping())) {
      Table table(
          {"  signal", "readings", "from [s]", "to [s]", "window [s]", "resolution", "unit", "lowest", "highest"});
      json signals = json::object();
      for (const auto& [signal, s] : run.signals) {
        const auto [low, high] = std::ranges::minmax(s.value);
        table.row({"  " + std::string(info(signal).name), std::to_string(s.t.size()), pretty(s.t.front(), 6),
                   pretty(s.t.back(), 6), s.window > 0 ? pretty(s.window) : "-", s.lsb > 0 ? pretty(s.lsb) : "-",
                   shown_unit(info(signal).unit), pretty(low), pretty(high)});
        signals[std::string(info(signal).name)] = {
            {"readings", s.t.size()}, {"from", s.t.front()}, {"to", s.t.back()}, {"window", s.window},
            {"lsb", s.lsb},           {"min", low},          {"max", high}};
      }
      if (run.name != text) std::cout << "  " << printable(run.name) << "\n";
      std::cout << table.text("", width_of_rows());
      one["runs"].push_back({{"name", run.name}, {"signals", signals}});
    }
    one["events"] = json::array();
    for (const Event& e : session.events) {
      std::cout << fitted("  event " + std::to_string(e.code) + " at " + pretty(e.t, 6) + " s: " + printable(e.text),
                          width_of_rows());
      one["events"].push_back({{"t", e.t}, {"code", e.code}, {"text", e.text}});
    }
    all.push_back(std::move(one));
  }
  write_json(o.json_file, all);
  return 0;
}

/// The parameters of several models side by side; --truth adds what a simulated bench was built with.
int table_command(const FileOptions& o) {
  std::vector<Model> models;
  for (const std::string& file : o.models) models.push_back(read_model(file));
  std::vector<std::string> names;
  for (const Model& model : models) {
    for (const std::string& name : model.names()) {
      if (std::ranges::find(names, name) == names.end()) names.push_back(name);
    }
  }
  std::vector<std::string> heading{"parameter"};
  for (const std::string& file : o.models) heading.push_back(std::filesystem::path(file).stem().string());
  std::optional<YamlMap> simulation;
  if (!o.truth.empty()) {
    simulation = YamlMap::load(o.truth).map("simulation");
    heading.push_back("true");
  }
  heading.push_back("unit");
  Table table(heading);
  for (const std::string& name : names) {
    std::vector<std::string> row{name};
    std::string unit;
    for (const Model& model : models) {
      const std::vector<std::string> own = model.names();
      const auto found = std::ranges::find(own, name);
      if (found == own.end()) {
        row.push_back("");
        continue;
      }
      const auto place = static_cast<std::size_t>(found - own.begin());
      unit = shown_unit(model.at(place).unit);
      row.push_back(pretty(model.values()[place], 4));
    }
    if (simulation) {
      // The plant groups its parameters by place: motor, friction ...; the symbol is unique.
      const std::string symbol = name.substr(name.find('.') == std::string::npos ? 0 : name.find('.') + 1);
      std::string value;
      for (const std::string& key : simulation->keys()) {
        if (!simulation->node()[key].IsMap()) continue;
        const YamlMap part = simulation->map(key);
        if (part.has(symbol)) value = pretty(part.number(symbol), 4);
      }
      row.push_back(value);
    }
    row.push_back(unit);
    table.row(row);
  }
  std::cout << table.text("", width_of_rows());
  return 0;
}

}  // namespace

void add_file_commands(CommandLine& line, const std::shared_ptr<const KeptAnswers>& answers) {
  const auto o = std::make_shared<FileOptions>();
  const auto act = [&o](int (*command)(const FileOptions&)) { return [o, command] { return command(*o); }; };
  const auto session_help = "PATH[#RUN][@T0:T1], .csv, .h5 or .mat";
  const auto map_help = "how the columns of foreign CSV files become signals";

  line.command("simulate", "simulates a model under a profile")
      .argument("MODEL", o->model, "the model's YAML")
      .argument("PROFILE", o->profile, "a profile's file or name")
      .offers_beside_files(profile_names)
      .option("--out", o->out, "the simulated session, .csv, .h5 or .mat")
      .option("--rate", o->rate, "[Hz] samples a second")
      .action(act(simulate_command));
  line.command("import", "turns a foreign file into a session, or merges a meter's own log into one")
      .arguments("SESSION", o->sessions, session_help)
      .option("--from-log", o->log, "a log of i_a by the meter's own software and clock; --map is then of this file")
      .option("--map", o->map, map_help)
      .option("--out", o->out, "the file to write, .csv, .h5 or .mat")
      .action(act(convert_command));
  line.command("export", "turns a session into another format")
      .arguments("SESSION", o->sessions, session_help)
      .option("--map", o->map, map_help)
      .option("--out", o->out, "the file to write, .csv, .h5 or .mat")
      .option("--mat", o->mat, "of a .mat: 5, or 7.3 where it is larger than 2 GB")
      .one_of({"5", "7.3"})
      .action(act(convert_command));
  line.command("info", "says what a session holds")
      .arguments("SESSION", o->sessions, session_help)
      .option("--map", o->map, map_help)
      .option("--json", o->json_file, "writes it to this file; - for standard output")
      .action([o, answers] {
        return answers->answer({files_read({o->map}, o->sessions), files_written({o->json_file})},
                               [&] { return info_command(*o); });
      });
  line.command("table", "puts the parameters of several models side by side")
      .arguments("MODEL", o->models, "models' YAML")
      .option("--truth", o->truth, "a simulated bench's YAML: what its plant was built with")
      .action(act(table_command));
}

}  // namespace emtb
