#include "session/csv.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <limits>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "hal/error.h"
#include "hal/regular_file.h"
#include "session/csv_header.h"
#include "session/csv_table.h"
#include "session/names.h"
#include "session/shift.h"
#include "session/text.h"

namespace emtb {
namespace {

constexpr std::uint64_t longest_file = std::uint64_t{2} << 30;  // [byte]

std::string read_whole(const std::filesystem::path& path) {
  try {
    return read_regular_file(path, longest_file, "the path of a .csv");
  } catch (const Error& e) {
    throw SessionError(e.what());
  }
}

/// The mapping with delimiter and decimal sign as the file shows them, where they are not given: a header with
/// semicolons or tabs and no comma; below it, commas in numbers and no point.
Mapping completed(Mapping mapping, std::string_view text) {
  const std::string_view header = text.substr(0, text.find('\n'));
  if (mapping.delimiter == '\0') {
    mapping.delimiter = ',';
    for (const char c : {';', '\t'}) {
      if (header.find(c) != std::string_view::npos && header.find(',') == std::string_view::npos) mapping.delimiter = c;
    }
    if (mapping.decimal == ',' && mapping.delimiter == ',') mapping.delimiter = ';';
  }
  if (mapping.decimal == '\0') {
    const std::string_view rows = text.substr(std::min(text.size(), header.size()), std::size_t{1} << 14);
    const bool commas = mapping.delimiter != ',' && rows.find(',') != std::string_view::npos &&
                        rows.find('.') == std::string_view::npos;
    mapping.decimal = commas ? ',' : '.';
  }
  return mapping;
}

/// A run while its rows are read.
struct Recording {
  std::string name;
  double start = 0;
  double last = -std::numeric_limits<double>::infinity();
  std::string_view last_text;
  std::size_t rows = 0;
  std::array<Series, signal_count> series;
};

/// Takes row after row.
class Rows {
 public:
  Rows(const CsvTable& table, const CsvHeader& header, char decimal)
      : table_(table), header_(header), numbers_(table, decimal) {}

  /// Takes the row that the table has just read.
  void take() {
    check_width();
    Recording& run = run_of_row();
    const double t = take_time(run);
    for (const CsvColumn& column : header_.signals) take_value(run, column, t);
    for (const CsvProperty& property : header_.properties) take_property(run, property);
  }

  /// In the order of their first rows.
  std::vector<Recording>& recordings() { return recordings_; }

 private:
  void check_width() const {
    const std::size_t here = table_.cells().size();
    if (here == header_.width) return;
    const std::string counts = std::to_string(here) + " cells instead of " + std::to_string(header_.width);
    if (!table_.ends_in_newline() && here < header_.width) {
      table_.fail("the last line is cut off: " + counts + ". Delete it, or copy the file again");
    }
    table_.fail(counts + ". Leave cells without a reading empty, but keep their delimiters");
  }

  Recording& run_of_row() {
    const std::string_view name = header_.run ? table_.cells()[*header_.run] : std::string_view();
    if (recordings_.empty() || name != current_name_) {
      if (header_.run && name.empty())
        table_.fail("column " + shown(header_.run_name) + " is empty. Name the run in every row");
      const auto [found, is_new] = by_name_.try_emplace(name, recordings_.size());
      if (is_new) {
        recordings_.emplace_back();
        recordings_.back().name = unescaped(name);
        if (!header_.run) make_room(recordings_.back());
      }
      current_name_ = name;
      current_ = found->second;
    }
    return recordings_[current_];
  }

  /// For what the file holds, and no second place for it as it grows.
  void make_room(Recording& run) const {
    constexpr std::size_t most = std::size_t{1} << 22;  // 64 MB a signal: where lines grow shorter it is a guess
    const std::size_t rows = 1 + std::min(most, table_.rows_to_come());
    for (const CsvColumn& column : header_.signals) {
      run.series[index(column.signal)].t.reserve(rows);
      run.series[index(column.signal)].value.reserve(rows);
    }
  }

  double take_time(Recording& run) const {
    if (!header_.time) return header_.period * static_cast<double>(run.rows++);
    const std::string_view text = table_.cells()[*header_.time];
    if (text.empty()) table_.fail("column " + shown(header_.time_name) + " is empty. Every row needs a time");
    const double t = header_.time_scale * numbers_.parse(text, header_.time_name);
    check_time(run, t, text);
    if (run.last_text.empty()) run.start = t;
    run.last = t;
    run.last_text = text;
    return t;
  }

  /// Within a run the time increases.
  void check_time(const Recording& run, double t, std::string_view text) const {
    if (t > run.last) return;
    const std::string hint = header_.run ? "; rows of one run must stand in the order of time"
                                         : "; if the file holds several runs, tell them apart by a column `run`, or "
                                           "name theirs with --map, run: COLUMN";
    if (t == run.last) {
      table_.fail(header_.time_name + " stands still at " + shown(text) +
                  " s: two rows of one time are one reading too many. Leave one of them out" + hint);
    }
    table_.fail(header_.time_name + " goes back from " + shown(run.last_text) + " to " + shown(text) + " s" + hint);
  }

  void take_value(Recording& run, const CsvColumn& column, double t) const {
    double value = column.offset;
    if (column.cell) {
      const std::string_view cell = table_.cells()[*column.cell];
      if (cell.empty()) return;
      value += column.scale * numbers_.parse(cell, column.name);
    }
    if (std::abs(value) > largest_reading) {
      table_.fail("column " + shown(column.name) + ": " + shortest(value) +
                  " is no reading of a bench. Leave the cell empty where there is none");
    }
    if (column.signal == Signal::armature_open && value != 0 && value != 1) {
      table_.fail("column " + shown(column.name) + ": armature_open is " + shortest(value) +
                  ". It must be 0 (closed) or 1 (open)");
    }
    Series& series = run.series[index(column.signal)];
    series.t.push_back(t);
    series.value.push_back(value);
  }

  void take_property(Recording& run, const CsvProperty& property) const {
    const std::string_view cell = table_.cells()[property.cell];
    if (cell.empty()) return;
    const double value = numbers_.parse(cell, property.name);
    double& known = run.series[index(property.signal)].*property.what;
    if (value < 0 || (known > 0 && known != value)) {
      table_.fail("column " + shown(property.name) + ": " + shortest(value) +
                  (value < 0 ? ". It must be above 0" : " after " + shortest(known) + ". One value stands for a run") +
                  "; leave the cell empty where it is not known");
    }
    known = value;
  }

  const CsvTable& table_;
  const CsvHeader& header_;
  CsvNumbers numbers_;
  std::vector<Recording> recordings_;
  std::unordered_map<std::string_view, std::size_t> by_name_;  // views into the text, which outlives them
  std::string_view current_name_;
  std::size_t current_ = 0;
};

Run finished(const std::filesystem::path& path, Recording&& recording, const CsvHeader& header,
             const Mapping& mapping) {
  Run run{.name = std::move(recording.name), .signals = {}};
  for (const CsvColumn& column : header.signals) {
    Series& series = recording.series[index(column.signal)];
    if (series.t.empty()) continue;  // a column without a reading, such as that of a meter that was not connected
    shift_to_zero(series.t, recording.start);
    series.source = column.name;
    if (const auto window = mapping.window.find(column.signal); window != mapping.window.end())
      series.window = window->second;
    run.signals.emplace(column.signal, std::move(series));
  }
  share_times(run.signals);
  if (run.signals.empty()) {
    throw SessionError(path.string() + ": " + (run.name.empty() ? "" : "run " + shown(run.name) + ": ") +
                       "every cell of every signal is empty. Record at least one signal");
  }
  return run;
}

std::string quoted_if_needed(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"') out += '"';
    out += c == '\n' || c == '\r' ? ' ' : c;
  }
  return out + '"';
}

void append(std::string& out, double value) {
  char text[32];
  out.append(text, std::to_chars(text, text + sizeof text, value).ptr);
}

/// Which of the signals have a resolution or a window in some run.
std::vector<CsvProperty> known_properties(const Session& session, const std::vector<Signal>& columns) {
  std::vector<CsvProperty> known;
  const auto add = [&](Signal signal, double Series::*what, const std::string& name) {
    const bool stated =
        std::ranges::any_of(session.runs, [&](const Run& run) { return run.has(signal) && run.at(signal).*what > 0; });
    if (stated) known.push_back({0, signal, what, name});
  };
  for (const Signal signal : columns) {
    add(signal, &Series::lsb, lsb_column(signal));
    add(signal, &Series::window, window_column(signal));
  }
  return known;
}

/// What each instrument's columns say of a run. @return {of the first row, of those below}
std::pair<std::string, std::string> property_cells(const Run& run, const std::vector<CsvProperty>& properties) {
  std::string first;
  for (const CsvProperty& property : properties) {
    first += ',';
    const double value = run.has(property.signal) ? run.at(property.signal).*property.what : 0;
    if (value > 0) append(first, value);
  }
  return {first, std::string(properties.size(), ',')};
}

/// One run's rows: a row for each time at which any signal has a reading.
/// @param lead what each row begins with
void append_rows(std::string& out, const Run& run, const std::vector<Signal>& columns,
                 const std::vector<CsvProperty>& properties, const std::string& lead) {
  const auto [first, below] = property_cells(run, properties);
  const std::string* tail = &first;
  std::vector<const Series*> series;
  series.reserve(columns.size());
  for (const Signal signal : columns) series.push_back(run.has(signal) ? &run.at(signal) : nullptr);
  std::vector<std::size_t> next(columns.size(), 0);
  while (true) {
    double t = std::numeric_limits<double>::infinity();
    for (std::size_t c = 0; c < series.size(); ++c) {
      if (series[c] && next[c] < series[c]->t.size()) t = std::min(t, series[c]->t[next[c]]);
    }
    if (!std::isfinite(t)) return;
    out += lead;
    append(out, t);
    for (std::size_t c = 0; c < series.size(); ++c) {
      out += ',';
      if (series[c] && next[c] < series[c]->t.size() && series[c]->t[next[c]] == t)
        append(out, series[c]->value[next[c]++]);
    }
    out += *tail;
    tail = &below;
    out += '\n';
  }
}

}  // namespace

Session read_csv(const std::filesystem::path& path, const Mapping& mapping) {
  return read_csv_text(path, read_whole(path), mapping);
}

Session read_csv_text(const std::filesystem::path& path, const std::string& text, const Mapping& given) {
  if (given.delimiter != '\0' && given.delimiter == given.decimal) {
    throw SessionError(path.string() + ": the mapping takes `" + std::string(1, given.decimal) +
                       "` for both delimiter and decimal. They must differ");
  }
  const Mapping mapping = completed(given, text);
  CsvTable table(path, text, mapping.delimiter);
  if (!table.next()) {
    throw SessionError(path.string() +
                       ": is empty. It needs a line of column names, such as t_s,u_ref_V,omega_rad_s, and rows");
  }
  const CsvHeader header = read_csv_header(table, mapping);
  Rows rows(table, header, mapping.decimal);
  while (table.next()) rows.take();
  if (rows.recordings().empty()) table.fail("has column names but no rows");

  Session session;
  for (Recording& recording : rows.recordings()) {
    session.runs.push_back(finished(path, std::move(recording), header, mapping));
  }
  return session;
}

CsvHead read_csv_head(const std::filesystem::path& path, std::size_t rows) {
  constexpr std::size_t enough = std::size_t{1} << 18;
  if (std::error_code error; !std::filesystem::is_regular_file(path, error))
    throw SessionError(path.string() + ": is no file");
  std::ifstream in(path, std::ios::binary);
  std::string text(enough, '\0');
  in.read(text.data(), static_cast<std::streamsize>(enough));
  text.resize(static_cast<std::size_t>(in.gcount()));
  if (text.size() == enough) text.resize(text.rfind('\n') + 1);  // the last line may have been cut
  const Mapping shown_by_file = completed({}, text);
  CsvHead head{.delimiter = shown_by_file.delimiter, .decimal = shown_by_file.decimal, .columns = {}};
  CsvTable table(path, text, head.delimiter);
  if (!table.next()) throw SessionError(path.string() + ": has no line of column names");
  for (const std::string_view cell : table.cells()) {
    CsvHead::Column column{
        .name = unescaped(cell), .cells = {}, .is_time = may_be_time(cell), .signal = {}, .unit = {}};
    if (const auto named = named_column(column.name)) {
      column.signal = named->signal;
      column.unit = named->unit;
    }
    head.columns.push_back(std::move(column));
  }
  while (rows-- > 0 && table.next()) {
    const std::size_t width = std::min(head.columns.size(), table.cells().size());
    for (std::size_t c = 0; c < width; ++c) head.columns[c].cells.push_back(unescaped(table.cells()[c]));
  }
  return head;
}

void write_csv(const std::filesystem::path& path, const Session& session) {
  std::vector<Signal> columns;
  for (const Signal signal : all_signals()) {
    if (std::ranges::any_of(session.runs, [&](const Run& run) { return run.has(signal); })) columns.push_back(signal);
  }
  const std::vector<std::string> names = distinct_names(session.runs);
  const bool several = session.runs.size() > 1;

  std::string out = several ? "run,t_s" : "t_s";
  for (const Signal signal : columns) out += "," + std::string(info(signal).column);
  const std::vector<CsvProperty> properties = known_properties(session, columns);
  for (const CsvProperty& property : properties) out += "," + property.name;
  out += '\n';
  for (std::size_t r = 0; r < session.runs.size(); ++r) {
    const Run& run = session.runs[r];
    const std::string lead = several ? quoted_if_needed(names[r]) + "," : "";
    append_rows(out, run, columns, properties, lead);
  }

  std::ofstream file(path, std::ios::binary);
  file.write(out.data(), static_cast<std::streamsize>(out.size()));
  file.close();
  if (!file)
    throw SessionError(path.string() +
                       ": cannot be written. Is the folder there, yours to write, and the disk not full?");
}

}  // namespace emtb
