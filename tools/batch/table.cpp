#include "tools/batch/table.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>

#include "hal/error.h"
#include "report/text.h"
#include "session/table_file.h"

namespace emtb {
namespace {

using json = nlohmann::ordered_json;

std::optional<double> number_of(const json& value) {
  return value.is_number() ? std::optional(value.get<double>()) : std::nullopt;
}

std::string joined_words(const json& list) {
  std::string out;
  for (const json& word : list) out += (out.empty() ? "" : " ") + word.get<std::string>();
  return out;
}

void hold_against(const std::vector<BatchLimit>& limits, BatchRow& row) {
  for (const BatchLimit& limit : limits) {
    const BatchRow::Value* found = row.find(limit.of);
    const std::optional<double> value = limit.of == "error" ? row.error()
                                        : found != nullptr  ? std::optional(found->value)
                                                            : std::nullopt;
    if (!value) {
      row.beyond.push_back(limit.of + " is not known");
    } else if (*value < limit.min) {
      row.beyond.push_back(limit.of + " " + pretty(*value, 5) + " is below " + pretty(limit.min, 5));
    } else if (*value > limit.max) {
      row.beyond.push_back(limit.of + " " + pretty(*value, 5) + " is above " + pretty(limit.max, 5));
    }
  }
}

BatchRow row_of(const json& result, const std::vector<BatchLimit>& limits) {
  BatchRow row;
  row.serial = result.at("serial");
  row.time = result.at("time");
  row.sessions = joined_words(result.at("sessions"));
  row.state = result.at("state");
  if (row.state != "done") {
    row.message = result.value("message", "");
    return row;
  }
  row.verdict = result.value("verdict", "");
  if (result.contains("missing")) row.missing = joined_words(result.at("missing"));
  row.error_train = number_of(result.at("error").at("train"));
  row.error_held_out = number_of(result.at("error").at("held_out"));
  if (result.contains("parameters")) {
    for (const auto& [name, p] : result.at("parameters").items()) {
      row.values.push_back({name, p.value("unit", ""), p.at("value").get<double>(),
                            p.contains("std_error") ? number_of(p.at("std_error")) : std::nullopt});
    }
  }
  hold_against(limits, row);
  row.passes = row.beyond.empty();
  return row;
}

std::string shortest_number(std::optional<double> x) {
  if (!x) return {};
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, *x).ptr};
}

std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c == '\n' || c == '\r' ? ' ' : c);
  return out + '"';
}

std::string pass_word(const BatchRow& row) { return row.state == "bad" ? "bad" : row.passes ? "pass" : "fail"; }

std::string listed(const std::vector<std::string>& all) {
  std::string out;
  for (const std::string& one : all) out += (out.empty() ? "" : "; ") + one;
  return out;
}

std::string csv_of(const BatchTable& table) {
  const auto parameters = table.parameters();
  std::string out = "serial,time,result,verdict,missing,error_train,error_held_out";
  for (const auto& [name, unit] : parameters) out += "," + quoted(name) + "," + quoted(name + "_std_error");
  out += ",beyond,message,sessions\n";
  for (const BatchRow& row : table.rows) {
    out += quoted(row.serial) + "," + quoted(row.time) + "," + pass_word(row) + "," + row.verdict + "," +
           quoted(row.missing) + "," + shortest_number(row.error_train) + "," + shortest_number(row.error_held_out);
    for (const auto& [name, unit] : parameters) {
      const BatchRow::Value* v = row.find(name);
      out += "," + (v != nullptr ? shortest_number(v->value) : "") + "," +
             (v != nullptr ? shortest_number(v->std_error) : "");
    }
    out += "," + quoted(listed(row.beyond)) + "," + quoted(row.message) + "," + quoted(row.sessions) + "\n";
  }
  return out;
}

std::vector<TableColumn> columns_of(const BatchTable& table) {
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  std::vector<TableColumn> out;
  const auto texts = [&](const std::string& name, const auto& get) {
    out.push_back({.name = name, .unit = {}, .numbers = {}, .texts = {}});
    for (const BatchRow& row : table.rows) out.back().texts.push_back(get(row));
  };
  const auto numbers = [&](const std::string& name, const std::string& unit, const auto& get) {
    out.push_back({.name = name, .unit = unit, .numbers = {}, .texts = {}});
    for (const BatchRow& row : table.rows) out.back().numbers.push_back(get(row).value_or(none));
  };
  texts("serial", [](const BatchRow& r) { return r.serial; });
  texts("time", [](const BatchRow& r) { return r.time; });
  texts("result", pass_word);
  texts("verdict", [](const BatchRow& r) { return r.verdict; });
  texts("missing", [](const BatchRow& r) { return r.missing; });
  numbers("error_train", "1", [](const BatchRow& r) { return r.error_train; });
  numbers("error_held_out", "1", [](const BatchRow& r) { return r.error_held_out; });
  for (const auto& [name, unit] : table.parameters()) {
    numbers(name, unit, [&, n = name](const BatchRow& r) {
      const BatchRow::Value* v = r.find(n);
      return v != nullptr ? std::optional(v->value) : std::nullopt;
    });
    numbers(name + "_std_error", unit, [&, n = name](const BatchRow& r) {
      const BatchRow::Value* v = r.find(n);
      return v != nullptr ? v->std_error : std::nullopt;
    });
  }
  texts("beyond", [](const BatchRow& r) { return listed(r.beyond); });
  texts("message", [](const BatchRow& r) { return r.message; });
  texts("sessions", [](const BatchRow& r) { return r.sessions; });
  return out;
}

}  // namespace

const BatchRow::Value* BatchRow::find(const std::string& name) const {
  const auto found = std::ranges::find(values, name, &Value::name);
  return found == values.end() ? nullptr : &*found;
}

std::size_t BatchTable::passed() const {
  return static_cast<std::size_t>(std::ranges::count(rows, true, &BatchRow::passes));
}
std::size_t BatchTable::bad() const {
  return static_cast<std::size_t>(std::ranges::count(rows, "bad", &BatchRow::state));
}

std::vector<std::pair<std::string, std::string>> BatchTable::parameters() const {
  std::vector<std::pair<std::string, std::string>> out;
  for (const BatchRow& row : rows) {
    for (const BatchRow::Value& v : row.values) {
      if (std::ranges::find(out, v.name, &std::pair<std::string, std::string>::first) == out.end()) {
        out.emplace_back(v.name, v.unit);
      }
    }
  }
  return out;
}

BatchTable make_table(const Manifest& manifest, const std::vector<json>& results) {
  BatchTable table{.name = manifest.name, .work = name_of(manifest.work), .limits = manifest.limits, .rows = {}};
  for (const json& result : results) table.rows.push_back(row_of(result, manifest.limits));
  return table;
}

void replace_with_text(const std::filesystem::path& file, const std::string& text) {
  // Processes may do the same at once: each its own draft.
  static std::atomic<unsigned> drafts{0};
  std::array<char, 256> machine{};
  gethostname(machine.data(), machine.size() - 1);
  const std::filesystem::path draft =
      file.parent_path() / ("." + file.filename().string() + "." + machine.data() + "." + std::to_string(getpid()) +
                            "." + std::to_string(drafts++));
  std::ofstream out(draft, std::ios::binary);
  out << text;
  out.close();
  std::error_code error;
  if (out) std::filesystem::rename(draft, file, error);
  if (!out || error)
    throw Error(file.string() + ": cannot be written. Is the folder yours to write, the disk not full?");
}

void write_tables(const BatchTable& table, const std::filesystem::path& folder) {
  replace_with_text(folder / "table.csv", csv_of(table));
  write_table(folder / "table.h5", columns_of(table),
              {{"format", "emtb batch 1"}, {"name", table.name}, {"work", table.work}});
  replace_with_text(folder / "index.html", page_of(table));
}

}  // namespace emtb
