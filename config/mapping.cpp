#include "config/mapping.h"

#include "config/yaml.h"

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

Mapping::Source read_source(const YamlMap& yaml) {
  yaml.only({"from", "scale", "offset"});
  Mapping::Source source{
      .column = yaml.text("from"), .scale = yaml.number_or("scale", 1), .offset = yaml.number_or("offset", 0)};
  if (source.scale == 0)
    yaml.fail("scale", "is 0, which leaves nothing of the column. Write its size in the signal's unit");
  return source;
}

}  // namespace

Mapping read_mapping(const std::filesystem::path& path) {
  const YamlMap yaml = YamlMap::load(path);
  yaml.only({"time", "run", "columns", "window", "delimiter", "decimal"});
  Mapping mapping;
  mapping.time = yaml.text_or("time", mapping.time);
  mapping.run = yaml.text_or("run", mapping.run);
  if (yaml.has("columns")) {
    const YamlMap columns = yaml.map("columns");
    for (const std::string& name : columns.keys()) {
      const Signal signal = need_signal(columns, name);
      if (!mapping.columns.emplace(signal, read_source(columns.map(name))).second)
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
  mapping.delimiter = need_char(yaml, "delimiter", mapping.delimiter);
  mapping.decimal = need_char(yaml, "decimal", mapping.decimal);
  if (mapping.decimal != '.' && mapping.decimal != ',') yaml.fail("decimal", "must be \".\" or \",\"");
  if (mapping.decimal == mapping.delimiter) {
    yaml.fail(yaml.has("decimal") ? "decimal" : "delimiter",
              "is the same for delimiter and decimal. Write e.g. delimiter: \";\"");
  }
  return mapping;
}

}  // namespace emtb
