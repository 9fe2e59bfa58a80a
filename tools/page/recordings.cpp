#include "tools/page/recordings.h"

#include <algorithm>
#include <fstream>
#include <set>

#include "config/profile.h"
#include "config/profile_path.h"
#include "config/shipped.h"
#include "hal/error.h"
#include "hal/printable.h"
#include "report/text.h"
#include "server/client.h"
#include "server/rpc.h"
#include "session/spec.h"
#include "tools/page/numbers.h"

namespace emtb::page {
namespace {

constexpr std::size_t most_listed = 500;
constexpr std::size_t longest_note = 4000;

bool is_recording(const std::filesystem::path& file) { return file.extension() == ".h5" || file.extension() == ".csv"; }

/// One signal of the longest run, in as few bins as a row of a list has room for: the speed, or what comes next to it.
json picture(const Session& session) {
  constexpr std::size_t bins = 48;
  const auto longest = std::ranges::max_element(session.runs, {}, &Run::duration);
  if (longest == session.runs.end()) return nullptr;
  for (const Signal signal : {Signal::omega, Signal::theta, Signal::i_a, Signal::e_a, Signal::u_ref, Signal::torque}) {
    if (!longest->has(signal)) continue;
    json one = binned(longest->at(signal), {.from = 0, .to = longest->duration(), .points = bins});
    one["signal"] = info(signal).name;
    one["unit"] = info(signal).unit;
    return one;
  }
  return nullptr;
}

/// What the daemon says, or an empty object where none is there.
json asked(const std::filesystem::path& socket, const std::string& method) {
  if (socket.empty()) return json::object();
  try {
    return Client(socket).call(method, json::object());
  } catch (const Error&) {
    return json::object();
  }
}

}  // namespace

Recordings::Recordings(const Files& files) : files_(files) {}

std::vector<std::filesystem::path> Recordings::folders() const {
  std::set<std::filesystem::path> all;
  const auto take = [&all](const std::filesystem::path& folder) {
    std::error_code error;
    const auto real = std::filesystem::canonical(folder, error);
    if (!error && std::filesystem::is_directory(real)) all.insert(real);
  };
  for (const auto* specs : {&files_.sessions, &files_.held_out}) {
    for (const std::string& spec : *specs) take(std::filesystem::absolute(parse_session_spec(spec).path).parent_path());
  }
  take(files_.imports());
  if (const json config = asked(files_.socket, "config"); config.contains("data")) {
    take(config["data"].get<std::string>());
  }
  return {all.begin(), all.end()};
}

std::filesystem::path Recordings::checked(const std::string& path) const {
  std::error_code error;
  const auto real = std::filesystem::canonical(path, error);
  const auto allowed = folders();
  if (error || !is_recording(real) || std::ranges::find(allowed, real.parent_path()) == allowed.end()) {
    throw Error(printable(path) + ": no recording in a folder that the command line names");
  }
  return real;
}

json Recordings::notes() const {
  std::ifstream in(files_.state / "notes.json");
  json all = in ? json::parse(in, nullptr, false) : json::object();
  return all.is_object() ? all : json::object();
}

json Recordings::described(const std::filesystem::path& file, const Mapping& mapping) const {
  json one{{"path", file.string()}, {"name", file.filename().string()}};
  try {
    const Session session = read_session(file, mapping);
    for (const char* key : {"started_utc", "profile", "bench", "operator", "note"}) {
      const auto found = session.attributes.find(key);
      one[key] = found == session.attributes.end() ? "" : found->second;
    }
    one["complete"] = session.complete;
    double duration = 0;
    std::set<std::string> signals;
    for (const Run& run : session.runs) {
      duration += run.duration();
      for (const auto& [signal, series] : run.signals) signals.insert(std::string(info(signal).name));
    }
    one["duration"] = number(duration);
    one["picture"] = picture(session);
    one["signals"] = signals;
  } catch (const Error& e) {
    one["complete"] = false;
    one["error"] = e.what();
  }
  return one;
}

json Recordings::list(const Work* work) {
  json sessions = json::array();
  const json noted = notes();
  const Mapping mapping = work != nullptr ? work->mapping() : Mapping{};
  for (const auto& folder : folders()) {
    std::vector<std::filesystem::path> files;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
      if (entry.is_regular_file(error) && is_recording(entry.path())) files.push_back(entry.path());
    }
    std::ranges::sort(files);
    for (const auto& file : files) {
      if (sessions.size() >= most_listed) break;
      const auto written = std::filesystem::last_write_time(file, error);
      auto& [when, what] = known_[file.string()];
      if (what.is_null() || when != written) {
        what = described(file, mapping);
        when = written;
      }
      json one = what;
      const json mine = noted.value(file.string(), json::object());
      if (mine.contains("note")) one["note"] = mine["note"];
      one["tags"] = mine.value("tags", json::array());
      one["used"] = work != nullptr ? work->use_of(file) : "";
      sessions.push_back(std::move(one));
    }
  }
  return {{"sessions", sessions}};
}

void Recordings::note(const json& params) {
  const rpc::Params given(params);
  const auto file = checked(given.text("path"));
  json tags = json::array();
  for (const json& tag : params.value("tags", json::array())) {
    if (!tag.is_string() || tag.get<std::string>().size() > 100 || tags.size() >= 50)
      throw Error("tags are short words");
    tags.push_back(tag);
  }
  const std::string note = given.text_or("note", "");
  if (note.size() > longest_note) throw Error("a note has at most " + std::to_string(longest_note) + " characters");
  json all = notes();
  all[file.string()] = {{"note", note}, {"tags", tags}};
  std::error_code ignored;
  std::filesystem::create_directories(files_.state, ignored);
  const auto beside = files_.state / "notes.json.part";
  std::ofstream out(beside);
  out << all.dump(1, ' ', false, json::error_handler_t::replace) << "\n";
  if (!out.flush()) throw Error(beside.string() + ": cannot be written");
  std::filesystem::rename(beside, files_.state / "notes.json");
}

json Recordings::data(const json& params, const Mapping& mapping) const {
  const auto file = checked(rpc::Params(params).text("path"));
  json runs = json::array();
  for (const Run& run : read_session(file, mapping).runs) {
    runs.push_back({{"run", run.name},
                    {"duration", number(run.duration())},
                    {"signals", binned(run, Window::of(params, run.duration()))}});
  }
  return {{"runs", runs}};
}

json profile_names(const std::filesystem::path& socket) {
  const json config = asked(socket, "config");
  std::vector<std::filesystem::path> folders;
  if (config.contains("file")) {
    const auto bench = std::filesystem::path(config["file"].get<std::string>()).parent_path();
    folders = {bench / "profiles", bench / ".." / "profiles"};
  }
  folders.push_back(shipped("benches/fh2-simulated.yaml").parent_path().parent_path() / "profiles");
  std::set<std::string> names;
  for (const auto& folder : folders) {
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
      const std::string name = entry.path().stem().string();
      if (entry.path().extension() == ".yaml" && is_profile_name(name)) names.insert(name);
    }
  }
  return {{"profiles", names}};
}

json profile(const json& params, const std::filesystem::path& socket) {
  const std::string asked_for = rpc::Params(params).text("profile");
  const json config = asked(socket, "config");
  const bool text = asked_for.find('\n') != std::string::npos || asked_for.find(": ") != std::string::npos;
  const YamlMap yaml = text ? YamlMap::parse(asked_for, "profile")
                            : YamlMap::load(named_profile(asked_for, config.value("file", std::string())));
  const Experiment experiment = read_experiment(yaml);
  const Profile& p = experiment.profile;
  json t = json::array(), u = json::array(), pauses = json::array(), needs = json::object();
  for (const Knot& knot : p.knots()) {
    t.push_back(number(knot.t));
    u.push_back(number(knot.value));
  }
  for (const Pause& pause : experiment.pauses) {
    pauses.push_back({{"at", number(pause.at)}, {"say", pause.say}, {"within", number(pause.within)}});
  }
  if (const auto map = yaml.map_if("needs")) {
    for (const std::string& key : map->keys()) needs[key] = map->node()[key].as<std::string>();
  }
  json out{{"name", p.name()},
           {"kind", yaml.text_or("kind", "")},
           {"duration", p.duration()},
           {"t", t},
           {"u_ref", u},
           {"needs", needs},
           {"pauses", pauses},
           {"text", self_contained(yaml)}};
  if (config.contains("reference")) {
    const double low = config["reference"]["min"], high = config["reference"]["max"];
    if (p.min() < low || p.max() > high) {
      out["refused"] = "This bench allows " + pretty(low) + " to " + pretty(high) + " V; the profile goes from " +
                       pretty(p.min()) + " to " + pretty(p.max()) + " V.";
    }
  }
  return out;
}

json black_box(const json& params, const std::filesystem::path& socket) {
  const json status = asked(socket, "status");
  if (!status.contains("black_box") || !status["black_box"].is_string()) {
    throw rpc::Refusal(rpc::code::not_available, "no fault has left a black box since emtbd was started");
  }
  const std::string file = status["black_box"];
  const Session session = read_session(file);
  if (session.runs.empty()) throw Error(file + ": holds nothing");
  const Run& run = session.runs.back();
  json events = json::array();
  for (const Event& e : session.events) events.push_back({{"t", number(e.t)}, {"code", e.code}, {"text", e.text}});
  return {{"fault", status["fault"]},
          {"session", file},
          {"events", events},
          {"signals", binned(run, Window::of(params, run.duration()))}};
}

}  // namespace emtb::page
