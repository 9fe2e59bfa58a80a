#include "config/format.h"

#include "hal/format_version.h"

namespace emtb {
namespace {

/// Where the first key stands: behind the comments that a file begins with.
std::size_t first_key(const std::string& text, const YamlMap& yaml) {
  std::size_t at = 0;
  for (int line = 0; line < yaml.node().Mark().line; ++line) at = text.find('\n', at) + 1;
  return at;
}

int newest_of(std::string_view kind) { return kind == "bench" ? newest_format::bench : newest_format::model; }

}  // namespace

int read_format(const YamlMap& yaml, std::string_view kind, int newest) {
  if (!yaml.has("format")) return 0;
  const std::string words = yaml.text("format");
  const auto version = format_version(words, kind);
  if (!version) yaml.fail("format", "is `" + words + "`. Write " + format_words(kind, newest));
  if (*version > newest) yaml.fail("", made_by_a_newer(kind, *version, newest));
  return *version;
}

std::string kind_of(const YamlMap& yaml) {
  if (yaml.has("devices") || yaml.has("reference")) return "bench";
  if (yaml.has("parameters")) return "model";
  if (yaml.has("kind")) return "profile";
  if (yaml.has("columns") || yaml.has("time")) return "mapping";
  if (yaml.has("effects")) return "candidates";
  return "";
}

std::string upgraded(const std::string& text, const std::string& name) {
  const YamlMap yaml = YamlMap::parse(text, name);
  const std::string kind = kind_of(yaml);
  if (kind != "bench" && kind != "model") {
    yaml.fail("", "is neither a bench nor a model: only their files have versions");
  }
  const int newest = newest_of(kind);
  if (read_format(yaml, kind, newest) == newest) return text;
  // Version 1 is version 0 that says so.
  const std::string line =
      "format: " + format_words(kind, newest) + (text.find("\r\n") == std::string::npos ? "\n" : "\r\n");
  std::string result = text;
  if (yaml.has("format")) {
    const YAML::Node words = yaml.node()["format"];
    const std::size_t at = text.find(words.Scalar(), first_key(text, yaml));
    return result.replace(at, words.Scalar().size(), format_words(kind, newest));
  }
  const std::size_t at = first_key(text, yaml);
  if (at < text.size() && text[at] == '{') yaml.fail("", "is written in braces. Write one key a line");
  return result.insert(at, line);
}

}  // namespace emtb
