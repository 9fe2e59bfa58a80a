#include "session/csv.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "hal/error.h"
#include "session/names.h"
#include "session/shift.h"
#include "session/text.h"
#include "session/units.h"

namespace emtb {
namespace {

std::string read_whole(const std::filesystem::path& path) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) throw SessionError(path.string() + ": no such file. Give the path of a .csv");
  if (std::filesystem::is_directory(status))
    throw SessionError(path.string() + ": is a folder. Give the path of a .csv");
  std::ifstream in(path, std::ios::binary);
  std::string text;
  if (const auto size = std::filesystem::file_size(path, error); !error) {
    text.resize(size);
    in.read(text.data(), static_cast<std::streamsize>(size));
    text.resize(static_cast<std::size_t>(std::max<std::streamsize>(in.gcount(), 0)));
  } else {  // a pipe
    text.assign(std::istreambuf_iterator<char>(in), {});
  }
  if (!in && !in.eof()) throw SessionError(path.string() + ": cannot be read. Is it yours to read?");
  return text;
}

/// The rows of a CSV text, cell by cell.
class Table {
 public:
  Table(const std::filesystem::path& path, std::string_view text, char delimiter)
      : path_(path), rest_(text), delimiter_(delimiter) {
    if (rest_.starts_with("\xEF\xBB\xBF")) rest_.remove_prefix(3);
    if (rest_.starts_with("\xFF\xFE") || rest_.starts_with("\xFE\xFF")) {
      throw SessionError(path_.string() + ": is UTF-16 text. Save it as CSV in UTF-8");
    }
  }

  /// Reads the next line that is not blank. @return false at the end
  bool next() {
    do {
      if (rest_.empty()) return false;
      ++line_;
      const std::size_t end = std::min(rest_.find('\n'), rest_.size());
      text_ = rest_.substr(0, end);
      ends_in_newline_ = end < rest_.size();
      rest_.remove_prefix(ends_in_newline_ ? end + 1 : end);
      if (text_.ends_with('\r')) text_.remove_suffix(1);
    } while (trimmed(text_).empty());
    split();
    return true;
  }

  const std::vector<std::string_view>& cells() const { return cells_; }
  std::size_t line() const { return line_; }
  bool ends_in_newline() const { return ends_in_newline_; }

  [[noreturn]] void fail(const std::string& what) const {
    throw SessionError(path_.string() + ":" + std::to_string(line_) + ": " + what);
  }

 private:
  bool blank(char c) const { return (c == ' ' || c == '\t') && c != delimiter_; }

  std::string_view trimmed(std::string_view text) const {
    while (!text.empty() && blank(text.front())) text.remove_prefix(1);
    while (!text.empty() && blank(text.back())) text.remove_suffix(1);
    return text;
  }

  void split() {
    cells_.clear();
    const char* p = text_.data();
    const char* const end = p + text_.size();
    while (true) {
      while (p != end && blank(*p)) ++p;
      if (p != end && *p == '"') {
        p = quoted(p + 1, end);
      } else {
        const char* const begin = p;
        while (p != end && *p != delimiter_) ++p;
        cells_.push_back(trimmed({begin, static_cast<std::size_t>(p - begin)}));
      }
      if (p == end) return;
      ++p;
    }
  }

  /// @param p behind the opening quote @return the delimiter behind the cell, or the end
  const char* quoted(const char* p, const char* end) {
    const char* const begin = p;
    while (p != end && !(*p == '"' && !(p + 1 != end && p[1] == '"'))) p += *p == '"' ? 2 : 1;
    if (p == end) fail("a quote is opened but not closed on this line");
    cells_.emplace_back(begin, static_cast<std::size_t>(p - begin));
    ++p;
    while (p != end && blank(*p)) ++p;
    if (p != end && *p != delimiter_) fail("text follows the closing quote of `" + shown(cells_.back()) + "`");
    return p;
  }

  const std::filesystem::path& path_;
  std::string_view rest_;
  char delimiter_;
  std::string_view text_;
  std::vector<std::string_view> cells_;
  std::size_t line_ = 0;
  bool ends_in_newline_ = false;
};

/// A quote within a quoted cell is written twice.
std::string unescaped(std::string_view cell) {
  std::string out;
  for (std::size_t i = 0; i < cell.size(); ++i) {
    out += cell[i];
    if (cell[i] == '"' && i + 1 < cell.size() && cell[i + 1] == '"') ++i;
  }
  return out;
}

/// Letters and digits only, in lower case: `Omega [rad/s]` -> `omegarads`.
std::string bare(std::string_view column) {
  std::string out;
  for (const char c : column) {
    if (std::isalnum(static_cast<unsigned char>(c)))
      out += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return out;
}

bool one_letter_apart(std::string_view a, std::string_view b) {
  if (a.size() > b.size()) std::swap(a, b);
  if (b.size() - a.size() > 1) return false;
  const std::size_t same = static_cast<std::size_t>(std::ranges::mismatch(a, b).in1 - a.begin());
  return a.substr(std::min(same + (a.size() == b.size() ? 1 : 0), a.size())) == b.substr(std::min(same + 1, b.size()));
}

/// What people write behind a signal's name, in the order of Signal, spelt as bare() leaves it.
constexpr std::array<std::string_view, signal_count> other_units{
    " v mv kv ",
    " v mv kv ",
    " a ma ",
    " rads radsec radpers rpm rps hz degs dps revmin revs ",
    " rad deg degree degrees rev revs turns ",
    " nm mnm ncm knm nmm ",
    " a ma ",
    " c k f degc degf celsius kelvin ",
    " ",
};

/// The signal that a column can be meant for, though it is not called so; see csv.h.
std::optional<Signal> meant_for(std::string_view column) {
  const std::string text = bare(column);
  for (const Signal signal : all_signals()) {
    const std::string name = bare(info(signal).name);
    const std::string full = bare(info(signal).column);
    if (text == full || text == name) return signal;
    if (full.size() >= 5 && one_letter_apart(text, full)) return signal;
    if (text.starts_with(name) &&
        other_units[index(signal)].find(" " + text.substr(name.size()) + " ") != std::string::npos) {
      return signal;
    }
  }
  return std::nullopt;
}

bool meant_for_time(std::string_view column) {
  constexpr std::string_view names = " t ts tms tus time times timems timesec timeseconds timestamp seconds sec s ";
  return names.find(" " + bare(column) + " ") != std::string_view::npos;
}

/// Where a signal stands in a row.
struct Target {
  std::size_t cell = 0;
  Signal signal{};
  double scale = 1;
  double offset = 0;
  std::string column;
};

/// A column in a unit of its own, named like the contract's: `omega_rpm`, `i_a_mA`, `theta_deg`.
std::optional<Target> in_other_unit(const std::string& column) {
  for (const Signal signal : all_signals()) {
    const std::string start = std::string(info(signal).name) + "_";
    if (!column.starts_with(start)) continue;
    const auto conversion = unit_of(signal, std::string_view(column).substr(start.size()));
    if (conversion) return Target{0, signal, conversion->scale, conversion->offset, column};
  }
  return std::nullopt;
}

struct Header {
  std::size_t width = 0;
  std::size_t time = 0;
  double time_scale = 1;
  std::string time_name;
  std::optional<std::size_t> run;
  std::string run_name;
  std::vector<Target> targets;
};

std::optional<std::size_t> position(const Table& table, const std::vector<std::string>& names,
                                    const std::string& name) {
  const auto found = std::ranges::find(names, name);
  if (found == names.end()) return std::nullopt;
  if (std::find(found + 1, names.end(), name) != names.end())
    table.fail("column `" + shown(name) + "` stands twice. Rename one");
  return static_cast<std::size_t>(found - names.begin());
}

void refuse_near_misses(const Table& table, const std::vector<std::string>& names, const std::vector<Target>& known) {
  for (const std::string& name : names) {
    const auto signal = meant_for(name);
    if (!signal || std::ranges::find(known, *signal, &Target::signal) != known.end()) continue;
    const auto& [short_name, unit, column, meaning] = info(*signal);
    table.fail("column `" + shown(name) + "` looks like " + std::string(meaning) + ", which is called `" +
               std::string(column) + "` [" + std::string(unit) + "]. Rename it, or map it (--map): columns: {" +
               std::string(short_name) + ": {from: " + shown(name) + ", scale: ...}}");
  }
}

Header read_header(Table& table, const Mapping& mapping) {
  std::vector<std::string> names;
  for (const auto cell : table.cells()) names.push_back(unescaped(cell));
  const std::string here = "Columns here: " + listed(names);

  Header header;
  header.width = names.size();
  header.time_name = mapping.time;
  header.time_scale = mapping.time_scale;
  if (const auto time = position(table, names, mapping.time)) {
    header.time = *time;
  } else {
    std::string hint;
    if (names.size() == 1 && names[0].find_first_of(";\t,|") != std::string::npos) {
      const char found = names[0][names[0].find_first_of(";\t,|")];
      hint = " The cells seem to be separated by " +
             (found == '\t' ? std::string("tabs") : "`" + std::string(1, found) + "`") +
             ": name it with --map, delimiter: \"" + (found == '\t' ? std::string("\\t") : std::string(1, found)) +
             "\".";
    } else if (const auto time_like = std::ranges::find_if(names, meant_for_time); time_like != names.end()) {
      hint = " If `" + shown(*time_like) +
             "` is the time in s, rename it or name it with --map, time: " + shown(*time_like) + ".";
    }
    table.fail("no column `" + shown(mapping.time) + "` for the time in s." + hint + " " + here);
  }

  if (mapping.columns.empty()) {
    for (std::size_t i = 0; i < names.size(); ++i) {
      const auto signal = signal_of_column(names[i]);
      if (signal && position(table, names, names[i])) header.targets.push_back({i, *signal, 1, 0, names[i]});
    }
    for (std::size_t i = 0; i < names.size(); ++i) {
      const auto known = in_other_unit(names[i]);
      if (!known || std::ranges::find(header.targets, known->signal, &Target::signal) != header.targets.end()) continue;
      if (position(table, names, names[i]))
        header.targets.push_back({i, known->signal, known->scale, known->offset, names[i]});
    }
    refuse_near_misses(table, names, header.targets);
    if (header.targets.empty()) {
      table.fail(
          "no column that emtb knows, such as u_ref_V, e_a_V, i_a_A or omega_rad_s. Say with --map which is which. " +
          here);
    }
  }
  for (const auto& [signal, source] : mapping.columns) {
    const auto cell = position(table, names, source.column);
    if (!cell) {
      table.fail("no column `" + shown(source.column) + "`, from which the mapping takes " +
                 std::string(info(signal).name) + ". " + here);
    }
    header.targets.push_back({*cell, signal, source.scale, source.offset, source.column});
  }

  header.run_name = mapping.run.empty() && mapping.columns.empty() ? "run" : mapping.run;
  if (!header.run_name.empty()) header.run = position(table, names, header.run_name);
  if (!mapping.run.empty() && !header.run) {
    table.fail("no column `" + shown(mapping.run) + "`, by which the mapping splits runs. " + here);
  }
  return header;
}

/// Reads numbers with a point or a comma.
class Numbers {
 public:
  Numbers(const Table& table, char decimal) : table_(table), decimal_(decimal) {}

  double parse(std::string_view cell, const std::string& column) const {
    std::string pointed;
    std::string_view text = cell;
    if (text.starts_with('+')) text.remove_prefix(1);
    if (decimal_ != '.') {
      if (text.find('.') != std::string_view::npos) refuse(cell, column, false);
      pointed = text;
      std::ranges::replace(pointed, decimal_, '.');
      text = pointed;
    }
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    const bool whole = end == text.data() + text.size() && !text.empty();
    if (whole && error == std::errc() && std::isfinite(value)) return value;
    refuse(cell, column, whole);
  }

 private:
  [[noreturn]] void refuse(std::string_view cell, const std::string& column, bool number) const {
    const std::string what = "column " + shown(column) + ": `" + shown(cell) + "` is not ";
    if (number) table_.fail(what + "a finite number. Leave the cell empty where there is no reading");
    std::string hint = "Leave the cell empty where there is no reading";
    if (decimal_ != '.') hint = std::string("The mapping says decimal: \"") + decimal_ + "\"";
    if (decimal_ == '.' && cell.find(',') != std::string_view::npos)
      hint = "For decimal commas say so with --map, decimal: \",\"";
    table_.fail(what + "a number. " + hint);
  }

  const Table& table_;
  char decimal_;
};

struct Recording {
  std::string name;
  double start = 0;
  double last = -std::numeric_limits<double>::infinity();
  std::string_view last_text;
  std::array<Series, signal_count> series;
};

void check_time(const Table& table, const Header& header, const Recording& run, double t, std::string_view text) {
  if (t > run.last) return;
  const std::string hint = header.run ? "; rows of one run must stand in the order of time"
                                      : "; if the file holds several runs, tell them apart by a column `run`, or name "
                                        "theirs with --map, run: COLUMN";
  if (t == run.last) table.fail(header.time_name + " stands still at " + shown(text) + " s" + hint);
  table.fail(header.time_name + " goes back from " + shown(run.last_text) + " to " + shown(text) + " s" + hint);
}

Run finished(const std::filesystem::path& path, Recording&& recording, const Header& header, const Mapping& mapping) {
  Run run{.name = std::move(recording.name), .signals = {}};
  for (const Target& target : header.targets) {
    Series& series = recording.series[index(target.signal)];
    if (series.t.empty()) continue;  // a column without a reading, such as that of a meter that was not connected
    shift_to_zero(series.t, recording.start);
    series.source = target.column;
    if (const auto window = mapping.window.find(target.signal); window != mapping.window.end())
      series.window = window->second;
    run.signals.emplace(target.signal, std::move(series));
  }
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

}  // namespace

Session read_csv(const std::filesystem::path& path, const Mapping& given) {
  if (given.delimiter != '\0' && given.delimiter == given.decimal) {
    throw SessionError(path.string() + ": the mapping takes `" + std::string(1, given.decimal) +
                       "` for both delimiter and decimal. They must differ");
  }
  const std::string text = read_whole(path);
  const Mapping mapping = completed(given, text);
  Table table(path, text, mapping.delimiter);
  if (!table.next()) {
    throw SessionError(path.string() +
                       ": is empty. It needs a line of column names, such as t_s,u_ref_V,omega_rad_s, and rows");
  }
  const Header header = read_header(table, mapping);
  const Numbers numbers(table, mapping.decimal);

  std::vector<Recording> recordings;
  std::unordered_map<std::string_view, std::size_t> by_name;  // views into the text, which outlives them
  std::string_view current_name;
  std::size_t current = 0;
  while (table.next()) {
    const auto& cells = table.cells();
    if (cells.size() != header.width) {
      const std::string counts = std::to_string(cells.size()) + " cells instead of " + std::to_string(header.width);
      if (!table.ends_in_newline() && cells.size() < header.width) {
        table.fail("the last line is cut off: " + counts + ". Delete it, or copy the file again");
      }
      table.fail(counts + ". Leave cells without a reading empty, but keep their delimiters");
    }
    const std::string_view name = header.run ? cells[*header.run] : std::string_view();
    if (recordings.empty() || name != current_name) {
      if (header.run && name.empty())
        table.fail("column " + shown(header.run_name) + " is empty. Name the run in every row");
      const auto [found, is_new] = by_name.try_emplace(name, recordings.size());
      if (is_new) {
        recordings.emplace_back();
        recordings.back().name = unescaped(name);
      }
      current_name = name;
      current = found->second;
    }
    Recording& run = recordings[current];

    const std::string_view time_text = cells[header.time];
    if (time_text.empty()) table.fail("column " + shown(header.time_name) + " is empty. Every row needs a time");
    const double t = header.time_scale * numbers.parse(time_text, header.time_name);
    check_time(table, header, run, t, time_text);
    if (run.last_text.empty()) run.start = t;
    run.last = t;
    run.last_text = time_text;

    for (const Target& target : header.targets) {
      const std::string_view cell = cells[target.cell];
      if (cell.empty()) continue;
      const double value = target.scale * numbers.parse(cell, target.column) + target.offset;
      if (target.signal == Signal::armature_open && value != 0 && value != 1) {
        table.fail("column " + shown(target.column) + ": armature_open is " + shortest(value) +
                   ". It must be 0 (closed) or 1 (open)");
      }
      Series& series = run.series[index(target.signal)];
      series.t.push_back(t);
      series.value.push_back(value);
    }
  }
  if (recordings.empty()) table.fail("has column names but no rows");

  Session session;
  for (Recording& recording : recordings) session.runs.push_back(finished(path, std::move(recording), header, mapping));
  return session;
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
  out += '\n';
  for (std::size_t r = 0; r < session.runs.size(); ++r) {
    const Run& run = session.runs[r];
    const std::string lead = several ? quoted_if_needed(names[r]) + "," : "";
    std::vector<const Series*> series;
    series.reserve(columns.size());
    for (const Signal signal : columns) series.push_back(run.has(signal) ? &run.at(signal) : nullptr);
    std::vector<std::size_t> next(columns.size(), 0);
    while (true) {
      double t = std::numeric_limits<double>::infinity();
      for (std::size_t c = 0; c < series.size(); ++c) {
        if (series[c] && next[c] < series[c]->t.size()) t = std::min(t, series[c]->t[next[c]]);
      }
      if (!std::isfinite(t)) break;
      out += lead;
      append(out, t);
      for (std::size_t c = 0; c < series.size(); ++c) {
        out += ',';
        if (series[c] && next[c] < series[c]->t.size() && series[c]->t[next[c]] == t)
          append(out, series[c]->value[next[c]++]);
      }
      out += '\n';
    }
  }

  std::ofstream file(path, std::ios::binary);
  file.write(out.data(), static_cast<std::streamsize>(out.size()));
  file.close();
  if (!file)
    throw SessionError(path.string() +
                       ": cannot be written. Is the folder there, yours to write, and the disk not full?");
}

}  // namespace emtb
