#include "session/csv_header.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>
#include <utility>

#include "session/text.h"
#include "session/units.h"

namespace emtb {
namespace {

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

/// A column in a unit of its own, named like the contract's: `omega_rpm`, `i_a_mA`, `theta_deg`.
std::optional<CsvColumn> in_other_unit(const std::string& column) {
  for (const Signal signal : all_signals()) {
    const std::string start = std::string(info(signal).name) + "_";
    if (!column.starts_with(start)) continue;
    const auto conversion = unit_of(signal, std::string_view(column).substr(start.size()));
    if (conversion) return CsvColumn{0, signal, conversion->scale, conversion->offset, column};
  }
  return std::nullopt;
}

std::optional<std::size_t> position(const CsvTable& table, const std::vector<std::string>& names,
                                    const std::string& name) {
  const auto found = std::ranges::find(names, name);
  if (found == names.end()) return std::nullopt;
  if (std::find(found + 1, names.end(), name) != names.end())
    table.fail("column `" + shown(name) + "` stands twice. Rename one");
  return static_cast<std::size_t>(found - names.begin());
}

void refuse_near_misses(const CsvTable& table, const std::vector<std::string>& names,
                        const std::vector<CsvColumn>& known) {
  for (const std::string& name : names) {
    const auto signal = meant_for(name);
    if (!signal || std::ranges::find(known, *signal, &CsvColumn::signal) != known.end()) continue;
    const auto& [short_name, unit, column, meaning] = info(*signal);
    table.fail("column `" + shown(name) + "` looks like " + std::string(meaning) + ", which is called `" +
               std::string(column) + "` [" + std::string(unit) + "]. Rename it, or map it (--map): columns: {" +
               std::string(short_name) + ": {from: " + shown(name) + ", scale: ...}}");
  }
}

std::string columns_here(const std::vector<std::string>& names) { return "Columns here: " + listed(names); }

std::size_t time_position(const CsvTable& table, const std::vector<std::string>& names, const std::string& time) {
  if (const auto found = position(table, names, time)) return *found;
  std::string hint;
  if (names.size() == 1 && names[0].find_first_of(";\t,|") != std::string::npos) {
    const char found = names[0][names[0].find_first_of(";\t,|")];
    hint = " The cells seem to be separated by " +
           (found == '\t' ? std::string("tabs") : "`" + std::string(1, found) + "`") +
           ": name it with --map, delimiter: \"" + (found == '\t' ? std::string("\\t") : std::string(1, found)) + "\".";
  } else if (const auto time_like = std::ranges::find_if(names, may_be_time); time_like != names.end()) {
    hint = " If `" + shown(*time_like) +
           "` is the time in s, rename it or name it with --map, time: " + shown(*time_like) + ".";
  } else {
    hint = " If no column holds it, and the rows follow in even steps, say so with --map, period: SECONDS.";
  }
  table.fail("no column `" + shown(time) + "` for the time in s." + hint + " " + columns_here(names));
}

/// The columns that are called as the contract says, then those in other units: the same signal in SI is no loss, but
/// of two in other units neither is more to be believed.
std::vector<CsvColumn> columns_by_name(const CsvTable& table, const std::vector<std::string>& names) {
  std::vector<CsvColumn> columns;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto signal = signal_of_column(names[i]);
    if (signal && position(table, names, names[i])) columns.push_back({i, *signal, 1, 0, names[i]});
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto known = in_other_unit(names[i]);
    if (!known) continue;
    if (const auto same = std::ranges::find(columns, known->signal, &CsvColumn::signal); same != columns.end()) {
      if (same->name == info(known->signal).column) continue;
      table.fail("columns `" + shown(same->name) + "` and `" + shown(names[i]) + "` are both " +
                 std::string(info(known->signal).name) +
                 ". Rename the one that shall not count, or name the other with --map");
    }
    if (position(table, names, names[i])) columns.push_back({i, known->signal, known->scale, known->offset, names[i]});
  }
  refuse_near_misses(table, names, columns);
  if (columns.empty()) {
    table.fail(
        "no column that emtb knows, such as u_ref_V, e_a_V, i_a_A or omega_rad_s. Say with --map which is which. " +
        columns_here(names));
  }
  return columns;
}

std::vector<CsvColumn> mapped_columns(const CsvTable& table, const std::vector<std::string>& names,
                                      const Mapping& mapping) {
  std::vector<CsvColumn> columns;
  for (const auto& [signal, source] : mapping.columns) {
    if (source.constant) {
      columns.push_back({{}, signal, 0, source.offset, "a constant"});
      continue;
    }
    const auto cell = position(table, names, source.column);
    if (!cell) {
      table.fail("no column `" + shown(source.column) + "`, from which the mapping takes " +
                 std::string(info(signal).name) + ". " + columns_here(names));
    }
    columns.push_back({*cell, signal, source.scale, source.offset, source.column});
  }
  return columns;
}

/// Resolutions and windows of the signals that are read.
std::vector<CsvProperty> properties_by_name(const CsvTable& table, const std::vector<std::string>& names,
                                            const std::vector<CsvColumn>& signals) {
  std::vector<CsvProperty> properties;
  for (const CsvColumn& column : signals) {
    const Signal signal = column.signal;
    if (const auto cell = position(table, names, lsb_column(signal)))
      properties.push_back({*cell, signal, &Series::lsb, lsb_column(signal)});
    if (const auto cell = position(table, names, window_column(signal)))
      properties.push_back({*cell, signal, &Series::window, window_column(signal)});
  }
  return properties;
}

}  // namespace

bool may_be_time(std::string_view column) {
  constexpr std::string_view names = " t ts tms tus time times timems timesec timeseconds timestamp seconds sec s ";
  return names.find(" " + bare(column) + " ") != std::string_view::npos;
}

std::optional<NamedColumn> named_column(const std::string& column) {
  if (const auto signal = signal_of_column(column)) return NamedColumn{*signal, std::string(info(*signal).unit)};
  if (const auto other = in_other_unit(column)) {
    const std::string unit = column.substr(info(other->signal).name.size() + 1);
    return NamedColumn{other->signal, std::string(unit_named(other->signal, unit))};
  }
  return std::nullopt;
}

std::string lsb_column(Signal signal) {
  const std::string unit = std::string(info(signal).column).substr(info(signal).name.size());
  return std::string(info(signal).name) + "_lsb" + unit;
}

std::string window_column(Signal signal) { return std::string(info(signal).name) + "_window_s"; }

CsvHeader read_csv_header(const CsvTable& table, const Mapping& mapping) {
  std::vector<std::string> names;
  for (const auto cell : table.cells()) names.push_back(unescaped(cell));
  CsvHeader header{
      .width = names.size(),
      .time = mapping.period > 0 ? std::nullopt : std::optional(time_position(table, names, mapping.time)),
      .time_scale = mapping.time_scale,
      .period = mapping.period,
      .time_name = mapping.time,
      .run = {},
      .run_name = mapping.run.empty() && mapping.columns.empty() ? "run" : mapping.run,
      .signals = mapping.columns.empty() ? columns_by_name(table, names) : mapped_columns(table, names, mapping),
      .properties = {}};
  if (mapping.columns.empty()) header.properties = properties_by_name(table, names, header.signals);
  if (!header.run_name.empty()) header.run = position(table, names, header.run_name);
  if (!mapping.run.empty() && !header.run) {
    table.fail("no column `" + shown(mapping.run) + "`, by which the mapping splits runs. " + columns_here(names));
  }
  return header;
}

}  // namespace emtb
