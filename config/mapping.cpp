#include "config/mapping.h"

#include "config/yaml.h"
#include "session/units.h"

namespace emtb {
namespace {

Signal need_signal(const YamlMap& yaml, const std::string& name) {
  const auto signal = signal_named(name);
  if (!signal) {
    std::string known;
    for (const Signal s : all_signals()) known += (known.empty() ? "" : ", ") + std::string(info(s).name);
    yaml.fail(name, "is not a signal. Signals: " + known);
  }
  return *signal;
}

char need_char(const YamlMap& yaml, std::string_view key, char fallback) {
  const std::string text = yaml.text_or(key, std::string(1, fallback));
  if (text == "tab") return '\t';
  if (text.size() != 1 || text == "\"" || text == "\n") yaml.fail(key, "must be one character, e.g. \";\", or tab");
  return text[0];
}

Mapping::Source read_source(const YamlMap& yaml, Signal signal) {
  Mapping::Source source;
  source.constant = yaml.has("value");
  if (source.constant) {
    yaml.only({"value", "unit"});
  } else {
    yaml.only({"from", "unit", "scale", "offset"});
    source.column = yaml.text("from");
    source.scale = yaml.number_or("scale", 1);
    source.offset = yaml.number_or("offset", 0);
  }
  if (yaml.has("unit")) {
    const std::string unit = yaml.text("unit");
    const auto conversion = unit_of(signal, unit);
    if (!conversion) {
      yaml.fail("unit", "is `" + unit + "`, but " + std::string(info(signal).name) +
                            " is in one of: " + known_units(signal) + ". For any other give its size as `scale`");
    }
    source.scale *= conversion->scale;
    source.offset += conversion->offset;
  }
  if (source.constant) source.offset += source.scale * yaml.number("value");
  if (source.scale == 0)
    yaml.fail("scale", "is 0, which leaves nothing of the column. Write its size in the signal's unit");
  return source;
}

double seconds(const YamlMap& yaml, std::string_view key) {
  const std::string unit = yaml.text(key);
  const auto scale = time_unit(unit);
  if (!scale) yaml.fail(key, "is `" + unit + "`. Write s, ms, us, min or h");
  return *scale;
}

/// The time's column: by its name, or written as those of the signals are.
void read_time(const YamlMap& yaml, Mapping& mapping) {
  if (yaml.has("period")) {
    if (yaml.has("time") || yaml.has("time_unit"))
      yaml.fail("period", "stands beside a time, which says when each row was read. Keep one");
    mapping.period = yaml.positive("period");
    return;
  }
  if (yaml.has("time_unit")) mapping.time_scale = seconds(yaml, "time_unit");
  if (!yaml.has("time")) return;
  if (!yaml.node()["time"].IsMap()) {
    mapping.time = yaml.text("time");
    return;
  }
  const YamlMap time = yaml.map("time");
  time.only({"from", "unit", "scale"});
  mapping.time = time.text("from");
  if (time.has("unit")) mapping.time_scale = seconds(time, "unit");
  if (time.has("scale")) mapping.time_scale *= time.positive("scale");
}

}  // namespace

Mapping read_mapping(const std::filesystem::path& path) { return read_mapping(YamlMap::load(path)); }

Mapping read_mapping(const YamlMap& yaml) {
  yaml.only({"time", "time_unit", "period", "run", "columns", "window", "delimiter", "decimal"});
  Mapping mapping;
  read_time(yaml, mapping);
  mapping.run = yaml.text_or("run", mapping.run);
  if (yaml.has("columns")) {
    const YamlMap columns = yaml.map("columns");
    for (const std::string& name : columns.keys()) {
      const Signal signal = need_signal(columns, name);
      if (columns.node()[name].IsScalar())
        columns.fail(name, "must be a map of `key: value` lines: write {from: " + columns.text(name) + "}");
      if (!mapping.columns.emplace(signal, read_source(columns.map(name), signal)).second)
        columns.fail(name, "stands twice. Keep one");
    }
  }
  if (yaml.has("window")) {
    const YamlMap windows = yaml.map("window");
    for (const std::string& name : windows.keys()) {
      const Signal signal = need_signal(windows, name);
      if (!mapping.columns.empty() && !mapping.columns.contains(signal)) {
        windows.fail(name, "has a window but no column. Name its column under `columns`");
      }
      if (!mapping.window.emplace(signal, windows.positive(name)).second) windows.fail(name, "stands twice. Keep one");
    }
  }
  if (yaml.has("delimiter")) mapping.delimiter = need_char(yaml, "delimiter", ',');
  if (yaml.has("decimal")) {
    mapping.decimal = need_char(yaml, "decimal", '.');
    if (mapping.decimal != '.' && mapping.decimal != ',') yaml.fail("decimal", "must be \".\" or \",\"");
  }
  if (mapping.decimal != '\0' && mapping.decimal == mapping.delimiter) {
    yaml.fail(yaml.has("decimal") ? "decimal" : "delimiter",
              "is the same for delimiter and decimal. Write e.g. delimiter: \";\"");
  }
  return mapping;
}

}  // namespace emtb
