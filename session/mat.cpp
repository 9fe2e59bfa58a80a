#include "session/mat.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>

#include "hal/error.h"
#include "hal/format_version.h"
#include "session/child.h"
#include "session/csv.h"
#include "session/h5.h"
#include "session/matio.h"
#include "session/names.h"
#include "session/replace.h"
#include "session/text.h"

namespace emtb {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& variable, const std::string& what) {
  throw SessionError(path.string() + ": " + variable + " " + what);
}

double number_of(const matvar_t* variable) {
  const auto value = mat::numbers(variable);
  return value && value->size() == 1 && std::isfinite(value->front()) ? value->front() : 0;
}

/// Times that increase, and values of a bench; NaN is left out.
Series series_of(const std::filesystem::path& path, const std::string& name, Signal signal, matvar_t* stored) {
  const auto t = mat::numbers(mat::field(stored, "t")), value = mat::numbers(mat::field(stored, "value"));
  if (!t || !value) fail(path, name, "has not both `t` and `value`, real numbers");
  if (t->size() != value->size()) {
    fail(path, name, "has " + std::to_string(t->size()) + " times but " + std::to_string(value->size()) + " values");
  }
  const std::string unit = mat::text(mat::field(stored, "unit")).value_or("");
  if (!unit.empty() && unit != info(signal).unit)
    fail(path, name, "has the unit " + shown(unit) + ". Convert it to " + std::string(info(signal).unit));
  Series series;
  double last = -std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < t->size(); ++k) {
    const double at = (*t)[k], reading = (*value)[k];
    if (std::isnan(reading)) continue;
    if (!std::isfinite(at) || std::abs(at) > largest_reading || !(std::abs(reading) <= largest_reading))
      fail(path, name, "has no reading of a bench in row " + std::to_string(k + 1));
    if (at <= last) fail(path, name, "goes back in time in row " + std::to_string(k + 1));
    series.t.push_back(last = at);
    series.value.push_back(reading);
  }
  series.window = std::max(0.0, number_of(mat::field(stored, "window")));
  series.lsb = std::max(0.0, number_of(mat::field(stored, "lsb")));
  series.source = mat::text(mat::field(stored, "source")).value_or("");
  return series;
}

Run run_of(const std::filesystem::path& path, const std::string& name, matvar_t* signals) {
  Run run;
  for (const Signal signal : all_signals()) {
    const std::string field(info(signal).name);
    matvar_t* const stored = mat::field(signals, field.c_str());
    if (stored == nullptr) continue;
    Series series = series_of(path, name + "." + field, signal, stored);
    if (!series.t.empty()) run.signals.emplace(signal, std::move(series));
  }
  share_times(run.signals);
  return run;
}

void take_events(Session& session, matvar_t* events) {
  const auto t = mat::numbers(mat::field(events, "t")), code = mat::numbers(mat::field(events, "code"));
  matvar_t* const texts = mat::field(events, "text");
  if (!t || !code || t->size() != code->size()) return;
  for (std::size_t k = 0; k < t->size(); ++k) {
    std::string text;
    if (texts != nullptr && texts->class_type == MAT_C_CELL && k < mat::count(texts) && texts->data != nullptr)
      text = mat::text(static_cast<matvar_t**>(texts->data)[k]).value_or("");
    session.events.push_back({(*t)[k], static_cast<int>((*code)[k]), text});
  }
}

/// A .mat that says what its runs are.
Session session_of(const std::filesystem::path& path, mat_t* file, const mat::Variable& runs) {
  Session session;
  const auto variable = [&](const char* name) { return mat::Variable(Mat_VarRead(file, name)); };
  for (std::size_t k = 0; k < mat::count(runs.get()); ++k) {
    const std::string name = "runs(" + std::to_string(k + 1) + ")";
    Run run = run_of(path, name + ".signals", mat::field(runs.get(), "signals", k));
    run.name = mat::text(mat::field(runs.get(), "name", k)).value_or("");
    run.field_on = std::max(0.0, number_of(mat::field(runs.get(), "field_on", k)));
    if (!run.signals.empty()) session.runs.push_back(std::move(run));
  }
  take_events(session, variable("events").get());
  session.config = mat::text(variable("config").get()).value_or("");
  session.complete = number_of(variable("incomplete").get()) == 0;
  const mat::Variable attributes = variable("attributes");
  for (const std::string& name : mat::fields(attributes.get())) {
    if (const auto text = mat::text(mat::field(attributes.get(), name.c_str()))) session.attributes[name] = *text;
  }
  return session;
}

/// A vector of somebody's file.
struct FlatColumn {
  std::string name;
  std::vector<double> values;
};

/// All vectors below a variable: itself, its columns, its fields.
void collect(std::vector<FlatColumn>& columns, matvar_t* variable, const std::string& name) {
  if (const auto values = mat::numbers(variable); values && variable->rank == 2) {
    const std::size_t rows = variable->dims[0], width = variable->dims[1];
    if (rows == 1 || width == 1) columns.push_back({name, *values});
    for (std::size_t c = 0; rows > 1 && width > 1 && c < width; ++c) {
      const auto first = values->begin() + static_cast<std::ptrdiff_t>(c * rows);
      columns.push_back(
          {name + "(:," + std::to_string(c + 1) + ")", {first, first + static_cast<std::ptrdiff_t>(rows)}});
    }
  }
  if (variable == nullptr || mat::count(variable) != 1) return;
  for (const std::string& field : mat::fields(variable))
    collect(columns, mat::field(variable, field.c_str()), name + "." + field);
}

/// The vectors that are as long as the time, as rows of a CSV: what names and mappings mean is settled there.
std::string as_csv(const std::filesystem::path& path, const std::vector<FlatColumn>& columns, const std::string& time) {
  const auto clock = std::ranges::find(columns, time, &FlatColumn::name);
  std::vector<std::string> names;
  for (const FlatColumn& column : columns) names.push_back(column.name);
  if (clock == columns.end()) {
    throw SessionError(path.string() + ": has neither `runs` nor a vector `" + time +
                       "` for the time in s. Name it with --map, time: VARIABLE. Vectors here: " + listed(names));
  }
  std::string text;
  const std::size_t rows = clock->values.size();
  std::vector<const FlatColumn*> kept;
  for (const FlatColumn& column : columns) {
    if (column.values.size() != rows) continue;
    text += (kept.empty() ? "\"" : ",\"") + column.name + "\"";
    kept.push_back(&column);
  }
  for (std::size_t r = 0; r < rows; ++r) {
    for (std::size_t c = 0; c < kept.size(); ++c) {
      text += c == 0 ? '\n' : ',';
      if (!std::isnan(kept[c]->values[r])) text += shortest(kept[c]->values[r]);
    }
  }
  return text + "\n";
}

Session foreign(const std::filesystem::path& path, mat_t* file, Mapping mapping) {
  std::vector<FlatColumn> columns;
  Mat_Rewind(file);
  while (const mat::Variable variable{Mat_VarReadNext(file)})
    collect(columns, variable.get(), variable->name == nullptr ? "" : variable->name);
  mapping.delimiter = ',';
  mapping.decimal = '.';
  std::string as_long_as = mapping.time;
  if (mapping.period > 0) {
    for (const auto& [signal, source] : mapping.columns) {
      if (!source.constant) as_long_as = source.column;
    }
  }
  return read_csv_text(path, as_csv(path, columns, as_long_as), mapping);
}

/// In a process that may die of it.
Session read_here(const std::filesystem::path& path, const Mapping& mapping) {
  const h5::Quiet quiet;
  if (std::error_code error; std::filesystem::exists(path, error) && !std::filesystem::is_regular_file(path, error))
    throw SessionError(path.string() + ": is a pipe or a device, no file that ends. Give the path of a .mat");
  const mat::File file(Mat_Open(path.c_str(), MAT_ACC_RDONLY));
  if (!file)
    throw SessionError(path.string() + ": cannot be opened as a .mat. Save it in MATLAB or Octave as -v7 or -v7.3");
  const mat::Variable format(Mat_VarRead(file.get(), "format"));
  const int version = format_version(mat::text(format.get()).value_or(""), "session").value_or(0);
  if (version > newest_format::session)
    throw SessionError(path.string() + ": " + made_by_a_newer("session", version, newest_format::session));
  if (!mapping.columns.empty()) return foreign(path, file.get(), mapping);
  if (const mat::Variable runs(Mat_VarRead(file.get(), "runs")); mat::field(runs.get(), "signals") != nullptr)
    return session_of(path, file.get(), runs);
  if (const mat::Variable signals(Mat_VarRead(file.get(), "signals")); !mat::fields(signals.get()).empty()) {
    Session session;
    session.runs.push_back(run_of(path, "signals", signals.get()));
    return session;
  }
  return foreign(path, file.get(), mapping);
}

bool is_identifier(const std::string& name) {
  constexpr std::size_t longest = 63;  // that MATLAB takes
  return !name.empty() && name.size() <= longest && std::isalpha(static_cast<unsigned char>(name[0])) != 0 &&
         std::ranges::all_of(name, [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; });
}

mat::Variable signals_of(const Run& run) {
  std::vector<std::string> names;
  for (const auto& [signal, series] : run.signals) names.emplace_back(info(signal).name);
  mat::Variable signals = mat::structure(nullptr, 1, names);
  for (const auto& [signal, series] : run.signals) {
    mat::Variable one = mat::structure(nullptr, 1, {"t", "value", "unit", "window", "lsb", "source"});
    mat::set(one, "t", mat::column(nullptr, series.t));
    mat::set(one, "value", mat::column(nullptr, series.value));
    mat::set(one, "unit", mat::of(nullptr, std::string(info(signal).unit)));
    mat::set(one, "window", mat::of(nullptr, series.window));
    mat::set(one, "lsb", mat::of(nullptr, series.lsb));
    mat::set(one, "source", mat::of(nullptr, series.source));
    mat::set(signals, std::string(info(signal).name), std::move(one));
  }
  return signals;
}

mat::Variable runs_of(const Session& session) {
  const std::vector<std::string> names = distinct_names(session.runs);
  mat::Variable runs = mat::structure("runs", session.runs.size(), {"name", "field_on", "signals"});
  for (std::size_t k = 0; k < session.runs.size(); ++k) {
    const bool named = session.runs.size() > 1 || !session.runs[k].name.empty();
    mat::set(runs, "name", mat::of(nullptr, named ? names[k] : std::string()), k);
    mat::set(runs, "field_on", mat::of(nullptr, session.runs[k].field_on), k);
    mat::set(runs, "signals", signals_of(session.runs[k]), k);
  }
  return runs;
}

mat::Variable events_of(const Session& session) {
  std::vector<double> t, code;
  std::vector<std::string> texts;
  for (const Event& event : session.events) {
    t.push_back(event.t);
    code.push_back(event.code);
    texts.push_back(event.text);
  }
  mat::Variable events = mat::structure("events", 1, {"t", "code", "text"});
  mat::set(events, "t", mat::column(nullptr, t));
  mat::set(events, "code", mat::column(nullptr, code));
  mat::set(events, "text", mat::cells(nullptr, texts));
  return events;
}

mat::Variable attributes_of(const Session& session) {
  std::vector<std::string> names;
  for (const auto& [name, text] : session.attributes) {
    if (is_identifier(name)) names.push_back(name);
  }
  mat::Variable attributes = mat::structure("attributes", 1, names);
  for (const std::string& name : names) mat::set(attributes, name, mat::of(nullptr, session.attributes.at(name)));
  return attributes;
}

}  // namespace

Session read_mat(const std::filesystem::path& path, const Mapping& mapping) {
  return read_in_child(path, [&](const std::filesystem::path& file) { return read_here(file, mapping); });
}

void write_mat(const std::filesystem::path& path, const Session& session, MatVersion version) {
  replace_file(path, [&](const std::filesystem::path& draft) {
    const h5::Quiet quiet;
    const bool old = version == MatVersion::v5;
    const mat::File file(Mat_CreateVer(draft.c_str(), old ? "MATLAB 5.0 MAT-file, written by emtb" : nullptr,
                                       old ? MAT_FT_MAT5 : MAT_FT_MAT73));
    bool written = static_cast<bool>(file);
    const auto put = [&](const mat::Variable& variable) {
      written = written && Mat_VarWrite(file.get(), variable.get(), MAT_COMPRESSION_ZLIB) == 0;
    };
    put(mat::of("format", format_words("session", newest_format::session)));
    put(runs_of(session));
    put(events_of(session));
    put(mat::of("config", session.config));
    put(mat::of("incomplete", session.complete ? 0 : 1));
    if (!session.attributes.empty()) put(attributes_of(session));
    if (!written) {
      throw SessionError(path.string() +
                         ": cannot be written. Is the folder there, yours to write, and the disk not full?");
    }
  });
}

}  // namespace emtb
