#include "session/hdf5.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>

#include "hal/error.h"
#include "session/child.h"
#include "session/field.h"
#include "session/names.h"
#include "session/replace.h"
#include "session/shift.h"
#include "session/stored.h"
#include "session/text.h"
#include "session/writer.h"

namespace emtb {
namespace {

Series read_series(const StoredSession& session, const StoredSession::StoredSignal& stored) {
  const std::string object = "/signals/" + std::string(info(stored.signal).name);
  Series series;
  series.t = session.numbers(object + "/t", stored.t, 0, stored.rows);
  series.value = session.numbers(object + "/value", stored.value, 0, stored.rows);
  series.window = stored.window;
  series.lsb = stored.lsb;
  series.source = stored.source;
  double last = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < series.t.size(); ++i) {
    const bool finite = std::isfinite(series.t[i]) && std::isfinite(series.value[i]);
    const bool credible = std::abs(series.value[i]) <= largest_reading && std::abs(series.t[i]) <= largest_reading;
    if (finite && credible && series.t[i] > last) {
      last = series.t[i];
      continue;
    }
    if (session.opened.abrupt) {  // the end of what reached the disk
      series.t.resize(i);
      series.value.resize(i);
      break;
    }
    const std::string row = "row " + std::to_string(i) + " ";
    if (!finite) session.fail(object, row + "is not finite. Leave out rows without a reading");
    if (!credible) session.fail(object, row + "is no reading of a bench: " + shortest(series.value[i]));
    session.fail(object + "/t", row + "goes back from " + shortest(last) + " to " + shortest(series.t[i]) +
                                    " s. Time must increase; mark runs with events of code " +
                                    std::to_string(event_code::run));
  }
  return series;
}

/// The marks at which runs begin, in the order of time.
std::vector<Event> run_marks(const std::vector<Event>& events) {
  std::vector<Event> marks;
  std::ranges::copy_if(events, std::back_inserter(marks), [](const Event& e) { return e.code == event_code::run; });
  std::ranges::stable_sort(marks, {}, &Event::t);
  return marks;
}

Series part_of(const Series& series, double begin, double end) {
  const auto first = std::ranges::lower_bound(series.t, begin) - series.t.begin();
  const auto last = std::ranges::lower_bound(series.t, end) - series.t.begin();
  Series part;
  part.t.assign(series.t.begin() + first, series.t.begin() + last);
  part.value.assign(series.value.begin() + first, series.value.begin() + last);
  part.window = series.window;
  part.lsb = series.lsb;
  part.source = series.source;
  return part;
}

/// [s] The first run begins at zero, wherever its mark stands.
double start_of(const std::vector<Event>& marks, std::size_t run) { return run == 0 ? 0 : marks[run].t; }

/// For how long the field had been on at a time [s], as the events until another tell; 0: they do not.
double field_on_at(double begin, double end, const std::vector<Event>& events) {
  for (const Event& event : events) {
    if (event.t < begin || event.t >= end) continue;
    if (const auto seconds = field_seconds(event)) return std::max(0.0, *seconds - (event.t - begin));
  }
  return 0;
}

std::vector<Run> split_into_runs(std::map<Signal, Series> signals, const std::vector<Event>& events) {
  const std::vector<Event> marks = run_marks(events);
  constexpr double forever = std::numeric_limits<double>::infinity();
  std::vector<Run> runs;
  if (marks.size() < 2) {
    runs.push_back({.name = marks.empty() ? "" : marks[0].text,
                    .signals = std::move(signals),
                    .field_on = field_on_at(0, forever, events)});
  } else {
    for (std::size_t m = 0; m < marks.size(); ++m) {
      const double begin = m == 0 ? -forever : marks[m].t;
      const double end = m + 1 < marks.size() ? marks[m + 1].t : forever;
      Run run{.name = marks[m].text, .signals = {}, .field_on = field_on_at(start_of(marks, m), end, events)};
      for (const auto& [signal, series] : signals) {
        Series part = part_of(series, begin, end);
        if (m > 0) shift_to_zero(part.t, begin);
        if (!part.t.empty()) run.signals.emplace(signal, std::move(part));
      }
      share_times(run.signals);
      runs.push_back(std::move(run));
    }
  }
  std::erase_if(runs, [](const Run& run) { return run.signals.empty(); });
  return runs;
}

/// Whether the session's own marks can stay: one for each run, of its name, behind the end of the run before.
bool marks_fit(const std::vector<Run>& runs, const std::vector<std::string>& names, const std::vector<Event>& marks) {
  if (marks.size() != runs.size()) return false;
  double end = -std::numeric_limits<double>::infinity();
  for (std::size_t r = 0; r < runs.size(); ++r) {
    if (marks[r].text != names[r] || marks[r].t <= end) return false;
    end = start_of(marks, r) + runs[r].duration();
  }
  return true;
}

/// Lays runs one behind the other, each at a whole second so that times stay short numbers.
std::vector<Event> new_marks(const std::vector<Run>& runs, const std::vector<std::string>& names) {
  std::vector<Event> marks;
  double begin = 0;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    marks.push_back({begin, event_code::run, names[r]});
    begin = std::floor(begin + runs[r].duration()) + 1;
  }
  return marks;
}

Channel channel_of(Signal signal, const Series& series) {
  const auto intervals = static_cast<double>(std::max<std::size_t>(series.t.size(), 2) - 1);
  return {.signal = signal,
          .period = (series.t.back() - series.t.front()) / intervals,
          .window = series.window,
          .lsb = series.lsb,
          .source = series.source};
}

void write_to(const std::filesystem::path& path, const Session& session) {
  const std::vector<std::string> names = distinct_names(session.runs);
  std::vector<Event> marks = run_marks(session.events);
  std::vector<Event> events = session.events;
  if (!marks_fit(session.runs, names, marks)) {
    marks = new_marks(session.runs, names);
    std::erase_if(events, [](const Event& e) { return e.code == event_code::run; });
    const bool named = session.runs.size() > 1 || (session.runs.size() == 1 && !session.runs[0].name.empty());
    if (named) events.insert(events.begin(), marks.begin(), marks.end());
  }
  std::erase_if(events, [](const Event& e) { return e.code == event_code::field; });
  for (std::size_t r = 0; r < session.runs.size(); ++r) {
    const double field_on = session.runs[r].field_on;
    if (field_on > 0) events.push_back({start_of(marks, r), event_code::field, field_words(field_on)});
  }
  std::ranges::stable_sort(events, {}, &Event::t);

  SessionWriter::Description description{.channels = {}, .attributes = session.attributes, .config = session.config};
  for (const Signal signal : all_signals()) {
    const auto run =
        std::ranges::find_if(session.runs, [&](const Run& r) { return r.has(signal) && !r.at(signal).t.empty(); });
    if (run != session.runs.end()) description.channels.push_back(channel_of(signal, run->at(signal)));
  }
  SessionWriter writer(path, description);
  for (std::size_t r = 0; r < session.runs.size(); ++r) {
    const double start = start_of(marks, r);
    for (const auto& [signal, series] : session.runs[r].signals) {
      if (series.t.empty()) continue;
      std::vector<double> t = series.t;
      for (double& time : t) time += start;
      writer.append(signal, t, series.value);
    }
  }
  for (const Event& event : events) writer.append(event);
  writer.flush();
  if (session.complete) writer.finish();
}

}  // namespace

namespace {

/// In a process that may die of it.
Session read_here(const std::filesystem::path& path) {
  const h5::Quiet quiet;
  try {
    const StoredSession stored = open_stored(path);
    Session session;
    session.events = stored.events;
    session.attributes = stored.attributes;
    session.config = stored.config;
    session.complete = stored.complete && !stored.opened.abrupt;
    std::map<Signal, Series> signals;
    for (const auto& signal : stored.signals) {
      Series series = read_series(stored, signal);
      if (series.t.empty()) continue;
      signals.emplace(signal.signal, std::move(series));
      share_times(signals);  // with each, so that they never stand for all
    }
    session.runs = split_into_runs(std::move(signals), session.events);
    return session;
  } catch (const std::bad_alloc&) {
    throw SessionError(path.string() +
                       ": is damaged, or larger than this machine's memory. Copy it again, or cut it in parts");
  }
}

}  // namespace

Session read_hdf5(const std::filesystem::path& path) { return read_in_child(path, read_here); }

void write_hdf5(const std::filesystem::path& path, const Session& session) {
  replace_file(path, [&](const std::filesystem::path& draft) { write_to(draft, session); });
}

}  // namespace emtb
