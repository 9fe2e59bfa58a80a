#include "config/yaml.h"

#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "hal/error.h"
#include "hal/one_line.h"
#include "hal/regular_file.h"

namespace emtb {
namespace {

std::string join(std::initializer_list<std::string_view> words) {
  std::string list;
  for (const auto word : words) list += (list.empty() ? "" : ", ") + std::string(word);
  return list;
}

/// As a person would write it: 6, 0.5, 1e-05.
std::string words(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

/// A key as it is written. YAML reads the word null as nothing at all; as a key it is a word like any other.
std::string written_key(const YAML::Node& node) { return node.IsNull() ? "null" : node.Scalar(); }

/// Where what the last document holds begins; the rest of it is passed over.
class Documents final : public YAML::EventHandler {
 public:
  int line = 0;

  void OnDocumentStart(const YAML::Mark& mark) override { at(mark, true); }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t) override { at(mark); }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override { at(mark); }
  void OnScalar(const YAML::Mark& mark, const std::string&, YAML::anchor_t, const std::string&) override { at(mark); }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {
    at(mark);
  }
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {
    at(mark);
  }
  void OnMapEnd() override {}

 private:
  void at(const YAML::Mark& mark, bool document = false) {
    if (document || begins_) line = mark.line;
    begins_ = document;
  }
  bool begins_ = false;
};

}  // namespace

YamlMap::YamlMap(const YAML::Node& node, std::filesystem::path file, std::string path)
    : node_(node), file_(std::move(file)), path_(std::move(path)) {
  if (!node_.IsMap()) fail("", "must be a map of `key: value` lines");
  // yaml-cpp keeps both of two equal keys and finds the first: the second would be a setting without effect.
  std::vector<std::string> seen;
  for (const auto& entry : node_) {
    if (!entry.first.IsScalar() && !entry.first.IsNull()) {
      fail_at(entry.first.Mark(), "", "has a key that is not a plain word");
    }
    const std::string key = written_key(entry.first);
    if (std::ranges::find(seen, key) != seen.end()) fail_at(entry.first.Mark(), key, "stands twice. Keep one");
    seen.emplace_back(key);
  }
}

YamlMap YamlMap::load(const std::filesystem::path& path) { return parse(read_text(path), path.string()); }

std::string YamlMap::read_text(const std::filesystem::path& path) {
  try {
    return read_regular_file(path, longest_file, "the path of a YAML file");
  } catch (const Error& e) {
    throw ConfigError(e.what());
  }
}

YamlMap YamlMap::parse(const std::string& text, const std::string& name) {
  try {
    // Not LoadAll(): of `,a: b` it makes documents without end, and takes all memory for them (yaml-cpp 0.7).
    std::istringstream in(text);
    YAML::Parser parser(in);
    Documents documents;
    if (!parser.HandleNextDocument(documents)) throw ConfigError(name + ":1: is empty. Write `key: value` lines");
    if (parser.HandleNextDocument(documents)) {
      throw ConfigError(name + ":" + std::to_string(documents.line + 1) +
                        ": starts a second document. Keep one in a file");
    }
    return YamlMap(YAML::Load(text), name, "");
  } catch (const YAML::Exception& e) {
    throw ConfigError(name + ":" + std::to_string(std::max(e.mark.line + 1, 1)) + ": not YAML: " + in_one_line(e.msg));
  }
}

YAML::Node YamlMap::find(std::string_view key) const {
  for (const auto& entry : node_) {
    if (written_key(entry.first) == key) return entry.second;
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
    const std::string key = written_key(entry.first);
    if (std::ranges::find(known, key) == known.end()) fail(key, "is not known here. Known: " + join(known));
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
  if (value <= 0) fail(key, "is " + words(value) + ", but must be above 0");
  return value;
}

double YamlMap::within(std::string_view key, double min, double max) const {
  const double value = number(key);
  if (value < min || value > max) {
    fail(key, "is " + words(value) + ", but must be " +
                  (max == std::numeric_limits<double>::infinity() ? words(min) + " or more"
                                                                  : words(min) + " to " + words(max)));
  }
  return value;
}

double YamlMap::within_or(std::string_view key, double min, double max, double fallback) const {
  return has(key) ? within(key, min, max) : fallback;
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
  return {node, file_, path_of(key)};
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
    list.push_back({node[i], file_, path_of(key) + "[" + std::to_string(i) + "]"});
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
  for (const auto& entry : node_) list.push_back(written_key(entry.first));
  return list;
}

std::string YamlMap::path_of(std::string_view key) const {
  return path_ + (path_.empty() || key.empty() ? "" : ".") + std::string(key);
}

void YamlMap::fail(std::string_view key, std::string_view what) const {
  // The key's own line: the value of `limits:` starts on the line after it.
  for (const auto& entry : node_) {
    if (node_.IsMap() && !key.empty() && written_key(entry.first) == key) fail_at(entry.first.Mark(), key, what);
  }
  fail_at(node_.Mark(), key, what);
}

void YamlMap::fail_at(const YAML::Mark& mark, std::string_view key, std::string_view what) const {
  const std::string name = path_of(key);
  throw ConfigError(file_.string() + ":" + std::to_string(std::max(mark.line + 1, 1)) + ": " +
                    in_one_line(name + (name.empty() ? "" : " ") + std::string(what)));
}

}  // namespace emtb
