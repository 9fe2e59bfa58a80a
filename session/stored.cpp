#include "session/stored.h"

#include <algorithm>

#include "hal/error.h"
#include "hal/format_version.h"
#include "session/text.h"

namespace emtb {
namespace {

h5::Column need_column(const StoredSession& session, const std::string& object) {
  try {
    return h5::column(session.opened.file, object);
  } catch (const h5::Failure& e) {
    session.fail(object, "is not there or not one column" + std::string(e.what()));
  }
}

std::vector<std::string> texts(const StoredSession& session, const std::string& object, const h5::Column& column,
                               hsize_t count) {
  try {
    return h5::texts(column, 0, count);
  } catch (const h5::Failure& e) {
    session.fail(object, "cannot be read" + std::string(e.what()));
  }
}

StoredSession::StoredSignal read_signal(const StoredSession& session, Signal signal) {
  const std::string object = "/signals/" + std::string(info(signal).name);
  StoredSession::StoredSignal stored{.signal = signal,
                                     .t = need_column(session, object + "/t"),
                                     .value = need_column(session, object + "/value"),
                                     .rows = 0,
                                     .lost = 0,
                                     .window = 0,
                                     .lsb = 0,
                                     .source = {}};
  stored.rows = std::min(stored.t.rows, stored.value.rows);
  if (stored.t.rows != stored.value.rows && !session.opened.abrupt && session.complete) {
    session.fail(object, "has " + std::to_string(stored.t.rows) + " times but " + std::to_string(stored.value.rows) +
                             " values. Write one value for each time");
  }
  if (session.opened.abrupt) {
    const auto size = std::filesystem::file_size(session.path);
    const hsize_t within = std::min(h5::rows_within(stored.t, size), h5::rows_within(stored.value, size));
    stored.lost = stored.rows - std::min(stored.rows, within);
    stored.rows -= stored.lost;
  }
  // The attributes stand at the group or at its values, whichever the file's maker found natural.
  const h5::Id group(H5Gopen2(session.opened.file, object.c_str(), h5::within_file(H5P_GROUP_ACCESS)));
  for (const hid_t at : {static_cast<hid_t>(group), static_cast<hid_t>(stored.value.id)}) {
    const std::string unit = h5::attribute(at, "unit").value_or("");
    if (!unit.empty() && unit != info(signal).unit) {
      session.fail(object, "has the unit " + shown(unit) + ". Convert it to " + std::string(info(signal).unit));
    }
    if (stored.window == 0) stored.window = h5::number_attribute(at, "window").value_or(0);
    if (stored.lsb == 0) stored.lsb = h5::number_attribute(at, "lsb").value_or(0);
    if (stored.source.empty()) stored.source = h5::attribute(at, "source").value_or("");
  }
  if (stored.window < 0) session.fail(object, "has a window of " + shortest(stored.window) + " s. Write 0 or more");
  stored.lsb = std::max(stored.lsb, 0.0);
  return stored;
}

std::vector<Event> read_events(const StoredSession& session) {
  std::vector<Event> events;
  if (!h5::exists(session.opened.file, "/events")) return events;
  const auto t = need_column(session, "/events/t");
  const auto code = need_column(session, "/events/code");
  const auto text = need_column(session, "/events/text");
  const hsize_t rows = std::min({t.rows, code.rows, text.rows});
  const auto times = session.numbers("/events/t", t, 0, rows);
  const auto codes = session.numbers("/events/code", code, 0, rows);
  const auto words = texts(session, "/events/text", text, rows);
  for (std::size_t i = 0; i < rows; ++i) events.push_back({times[i], static_cast<int>(codes[i]), words[i]});
  return events;
}

}  // namespace

bool StoredSession::intact() const {
  return !opened.abrupt && std::ranges::all_of(signals, [](const StoredSignal& s) { return s.t.rows == s.value.rows; });
}

void StoredSession::fail(const std::string& object, const std::string& what) const {
  throw SessionError(path.string() + ": " + object + " " + what);
}

std::vector<double> StoredSession::numbers(const std::string& object, const h5::Column& column, hsize_t first,
                                           hsize_t count) const {
  try {
    return h5::numbers(column, first, count);
  } catch (const h5::Failure& e) {
    fail(object, "cannot be read" + std::string(e.what()) +
                     (opened.abrupt ? ". Its recording ended abruptly: repair it: emtbd --repair FILE" : ""));
  }
}

StoredSession open_stored(const std::filesystem::path& path) {
  StoredSession session;
  session.path = path;
  session.opened = h5::open(path);
  const hid_t file = session.opened.file;
  const int version = format_version(h5::attribute(file, "format").value_or(""), "session").value_or(0);
  if (version > newest_format::session)
    throw SessionError(path.string() + ": " + made_by_a_newer("session", version, newest_format::session));
  if (!h5::exists(file, "/signals")) {
    session.fail("/signals", "is not there: HDF5, but no session, which holds /signals/NAME/{t,value}");
  }
  try {
    for (auto& [name, text] : h5::attributes(file)) {
      if (name == "complete") {
        session.complete = text == "1" || text == "true" || text == "True" || text == "TRUE";
      } else if (name != "format") {
        session.attributes.emplace(std::move(name), std::move(text));
      }
    }
    if (h5::exists(file, "/config")) {
      const auto config = need_column(session, "/config");
      for (const std::string& part : texts(session, "/config", config, config.rows)) session.config += part;
    }
    for (const Signal signal : all_signals()) {
      if (h5::exists(file, "/signals/" + std::string(info(signal).name))) {
        session.signals.push_back(read_signal(session, signal));
      }
    }
    session.events = read_events(session);
  } catch (const h5::Failure& e) {
    session.fail("/", "cannot be read" + std::string(e.what()));
  }
  return session;
}

}  // namespace emtb
