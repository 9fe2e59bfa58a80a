#include "config/yaml.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "hal/error.h"

namespace emtb {
namespace {

std::string join(std::initializer_list<std::string_view> words) {
  std::string list;
  for (const auto word : words) list += (list.empty() ? "" : ", ") + std::string(word);
  return list;
}

}  // namespace

YamlMap::YamlMap(YAML::Node node, std::filesystem::path file, std::string path)
    : node_(std::move(node)), file_(std::move(file)), path_(std::move(path)) {
  if (!node_.IsMap()) fail("", "must be a map of `key: value` lines");
}

YamlMap YamlMap::load(const std::filesystem::path& path) {
  std::ifstream in(path);
  std::stringstream text;
  if (std::filesystem::is_directory(path) || !in || !(text << in.rdbuf())) {
    throw ConfigError(path.string() + ": cannot be read. Give the path of a YAML file");
  }
  return parse(text.str(), path.string());
}

YamlMap YamlMap::parse(const std::string& text, const std::string& name) {
  try {
    return YamlMap(YAML::Load(text), name, "");
  } catch (const YAML::Exception& e) {
    throw ConfigError(name + ":" + std::to_string(e.mark.line + 1) + ": not YAML: " + e.msg);
  }
}

YAML::Node YamlMap::find(std::string_view key) const {
  for (const auto& entry : node_) {
    if (entry.first.Scalar() == key) return entry.second;
  }
  return YAML::Node(YAML::NodeType::Undefined);
}

YAML::Node YamlMap::need(std::string_view key) const {
  YAML::Node found = find(key);
  if (!found.IsDefined()) fail(key, "is missing");
  return found;
}

bool YamlMap::has(std::string_view key) const { return find(key).IsDefined(); }

void YamlMap::only(std::initializer_list<std::string_view> known) const {
  for (const auto& entry : node_) {
    const std::string& key = entry.first.Scalar();
    if (std::ranges::find(known, key) == known.end()) fail(key, "is not known here. Known: " + join(known));
    if (std::ranges::count_if(node_, [&](const auto& other) { return other.first.Scalar() == key; }) > 1) {
      fail(key, "stands twice. Keep one");
    }
  }
}

double YamlMap::number_of(const YAML::Node& node, std::string_view key) const {
  double value = 0;
  if (!node.IsScalar() || !YAML::convert<double>::decode(node, value)) {
    fail(key, "must be a number" + (node.IsScalar() ? ", not `" + node.Scalar() + "`" : std::string()));
  }
  if (!std::isfinite(value)) fail(key, "must be finite");
  return value;
}

double YamlMap::number(std::string_view key) const { return number_of(need(key), key); }

double YamlMap::number_or(std::string_view key, double fallback) const { return has(key) ? number(key) : fallback; }

double YamlMap::positive(std::string_view key) const {
  const double value = number(key);
  if (value <= 0) fail(key, "must be above 0");
  return value;
}

std::string YamlMap::text(std::string_view key) const {
  const YAML::Node node = need(key);
  if (!node.IsScalar()) fail(key, "must be a text");
  return node.Scalar();
}

std::string YamlMap::text_or(std::string_view key, std::string_view fallback) const {
  return has(key) ? text(key) : std::string(fallback);
}

bool YamlMap::flag_or(std::string_view key, bool fallback) const {
  if (!has(key)) return fallback;
  bool value = false;
  if (!YAML::convert<bool>::decode(find(key), value)) fail(key, "must be true or false");
  return value;
}

std::vector<double> YamlMap::numbers(std::string_view key) const {
  const YAML::Node list = need(key);
  if (!list.IsSequence()) fail(key, "must be a list of numbers, e.g. [1, 2, 3]");
  std::vector<double> values;
  for (const auto& entry : list) values.push_back(number_of(entry, key));
  return values;
}

std::vector<std::string> YamlMap::texts(std::string_view key) const {
  const YAML::Node list = need(key);
  std::vector<std::string> values;
  if (!list.IsSequence()) fail(key, "must be a list of texts");
  for (const auto& entry : list) {
    if (!entry.IsScalar()) fail(key, "must be a list of texts");
    values.push_back(entry.Scalar());
  }
  return values;
}

YamlMap YamlMap::map(std::string_view key) const {
  const YAML::Node node = need(key);
  if (!node.IsMap()) fail(key, "must be a map of `key: value` lines");
  return {node, file_, (path_.empty() ? "" : path_ + ".") + std::string(key)};
}

std::optional<YamlMap> YamlMap::map_if(std::string_view key) const {
  return has(key) ? std::optional{map(key)} : std::nullopt;
}

std::vector<YamlMap> YamlMap::maps(std::string_view key) const {
  std::vector<YamlMap> list;
  if (!has(key)) return list;
  const YAML::Node node = find(key);
  if (!node.IsSequence()) fail(key, "must be a list");
  for (std::size_t i = 0; i < node.size(); ++i) {
    if (!node[i].IsMap()) fail(key, "must be a list of maps");
    list.push_back({node[i], file_, (path_.empty() ? "" : path_ + ".") + std::string(key) + "[" + std::to_string(i) + "]"});
  }
  return list;
}

std::vector<std::pair<std::string, YamlMap>> YamlMap::entries() const {
  std::vector<std::pair<std::string, YamlMap>> list;
  for (const std::string& key : keys()) list.emplace_back(key, map(key));
  return list;
}

std::vector<std::string> YamlMap::keys() const {
  std::vector<std::string> list;
  for (const auto& entry : node_) list.push_back(entry.first.Scalar());
  return list;
}

void YamlMap::fail(std::string_view key, std::string_view what) const {
  const YAML::Node at = key.empty() ? node_ : find(key);
  const int line = (at.IsDefined() ? at.Mark().line : node_.Mark().line) + 1;
  std::string name = path_;
  if (!key.empty()) name += (name.empty() ? "" : ".") + std::string(key);
  throw ConfigError(file_.string() + ":" + std::to_string(std::max(line, 1)) + ": " + name + (name.empty() ? "" : " ") +
                    std::string(what));
}

}  // namespace emtb
