#include "tools/page/session_list.h"

#include <algorithm>
#include <fstream>
#include <set>

#include "hal/error.h"
#include "report/text.h"
#include "server/client.h"
#include "server/rpc.h"
#include "session/spec.h"
#include "tools/page/numbers.h"

namespace emtb::page {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t longest_note = 2000, longest_tag = 60, most_tags = 20, most_runs = 20;

/// One spelling for one file. A file that is not there keeps the spelling it has.
fs::path one_spelling(const fs::path& path) {
  std::error_code ignored;
  const fs::path canonical = fs::weakly_canonical(path, ignored);
  return ignored ? path : canonical;
}

bool is_recording(const fs::directory_entry& entry) {
  std::error_code ignored;
  const std::string name = entry.path().filename().string(), kind = entry.path().extension().string();
  return !name.starts_with(".") && (kind == ".h5" || kind == ".csv") && entry.is_regular_file(ignored);
}

/// What the file itself says; what is wrong with it, where it is none that emtb reads.
json describe(const fs::path& path, const Mapping& mapping) {
  json about{{"signals", json::array()}, {"duration", nullptr}, {"complete", true}, {"started_utc", nullptr}};
  try {
    const Session session = read_session(path, mapping);
    double longest = 0;
    std::set<std::string> signals;
    for (const Run& run : session.runs) {
      longest = std::max(longest, run.duration());
      for (const auto& [signal, series] : run.signals) signals.insert(std::string(info(signal).name));
    }
    about["signals"] = signals;
    about["duration"] = number(longest);
    about["complete"] = session.complete;
    for (const char* key : {"started_utc", "profile", "bench", "operator", "note"}) {
      if (const auto found = session.attributes.find(key); found != session.attributes.end()) {
        about[key] = printable(found->second);
      }
    }
  } catch (const std::exception& e) {
    about["wrong"] = printable(e.what());
  }
  return about;
}

}  // namespace

SessionList::SessionList(const Files& files, Mapping mapping, fs::path imports)
    : files_(files),
      mapping_(std::move(mapping)),
      imports_(std::move(imports)),
      notes_file_(files_.state / "notes.json") {
  read_notes();
}

void SessionList::read_notes() {
  std::ifstream in(notes_file_);
  if (!in) return;
  const json notes = json::parse(in, nullptr, false);
  if (notes.is_object()) notes_ = notes;
}

std::vector<fs::path> SessionList::folders() const {
  std::vector<fs::path> folders{imports_};
  for (const auto* specs : {&files_.sessions, &files_.held_out}) {
    for (const std::string& spec : *specs) folders.push_back(one_spelling(parse_session_spec(spec).path).parent_path());
  }
  if (!files_.socket.empty()) {
    try {
      folders.emplace_back(Client(files_.socket).call("config", nullptr).value("data", ""));
    } catch (const std::exception&) {  // no daemon now: what it recorded is listed again once it answers
    }
  }
  std::erase(folders, fs::path());
  for (fs::path& folder : folders) folder = one_spelling(folder);
  std::ranges::sort(folders);
  folders.erase(std::ranges::unique(folders).begin(), folders.end());
  return folders;
}

std::vector<fs::path> SessionList::recordings() const {
  std::vector<std::pair<fs::file_time_type, fs::path>> found;
  for (const fs::path& folder : folders()) {
    std::error_code none;
    for (fs::directory_iterator entry(folder, none), end; !none && entry != end; entry.increment(none)) {
      std::error_code gone;
      if (is_recording(*entry)) found.emplace_back(entry->last_write_time(gone), entry->path());
    }
  }
  std::ranges::sort(found, std::ranges::greater());
  if (found.size() > most) found.resize(most);
  std::vector<fs::path> paths;
  for (auto& [when, path] : found) paths.push_back(std::move(path));
  return paths;
}

/// The file that a page names, if it is one of those that may be shown.
fs::path SessionList::allowed(const std::string& path) const {
  const auto all = recordings();
  if (std::ranges::find(all, fs::path(path)) == all.end()) {
    throw Error(printable(path) + " is no recording in the folders of this page");
  }
  return path;
}

const json& SessionList::about(const fs::path& path) {
  std::error_code gone;
  const auto changed = fs::last_write_time(path, gone);
  const auto size = fs::file_size(path, gone);
  Known& known = known_[path];
  if (known.about.is_null() || known.changed != changed || known.size != size) {
    known = {changed, size, {}};
    known.about = size <= largest_listed ? describe(path, mapping_) : json{{"duration", nullptr}, {"complete", true}};
  }
  return known.about;
}

json SessionList::list(const Work& work) {
  json sessions = json::array();
  for (const fs::path& path : recordings()) {
    json one = about(path);
    one["path"] = path.string();
    one["name"] = printable(path.filename().string());
    one["tags"] = json::array();
    if (const auto noted = notes_.find(path.string()); noted != notes_.end()) one.update(*noted);
    one["used"] = work.use_of(path);
    sessions.push_back(std::move(one));
  }
  return {{"sessions", sessions}};
}

json SessionList::data(const json& params) const {
  const fs::path path = allowed(rpc::Params(params).text("path"));
  json runs = json::array();
  for (const Run& run : read_session(path, mapping_).runs) {
    if (runs.size() == most_runs) break;
    runs.push_back({{"run", printable(run.name)},
                    {"duration", number(run.duration())},
                    {"signals", binned(run, Window::of(params, run.duration()))}});
  }
  return {{"runs", runs}};
}

void SessionList::note(const json& params) {
  const rpc::Params checked(params);
  const fs::path path = allowed(checked.text("path"));
  const std::string note = checked.text_or("note", "");
  if (note.size() > longest_note) throw Error("a note has " + std::to_string(longest_note) + " bytes at most");
  json tags = json::array();
  for (const json& tag : params.value("tags", json::array())) {
    if (!tag.is_string() || tag.get_ref<const std::string&>().size() > longest_tag || tags.size() == most_tags) {
      throw Error("tags are up to 20 texts of 60 bytes at most");
    }
    tags.push_back(tag);
  }
  notes_[path.string()] = {{"note", note}, {"tags", tags}};
  std::error_code made;
  fs::create_directories(notes_file_.parent_path(), made);
  const fs::path beside = notes_file_.string() + ".part";
  std::ofstream out(beside);
  out << notes_.dump(1) << "\n";
  if (!out.flush()) throw Error(notes_file_.string() + ": the note cannot be saved there");
  out.close();
  fs::rename(beside, notes_file_);
}

}  // namespace emtb::page
