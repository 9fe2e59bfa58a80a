#include "config/schema.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>

#include "hal/one_line.h"

namespace emtb {
namespace {

std::optional<double> number_in(const YAML::Node& value) {
  double number = 0;
  if (!value.IsScalar() || !YAML::convert<double>::decode(value, number) || !std::isfinite(number)) return std::nullopt;
  return number;
}

/// A scalar is what an enum or a const names: as a number where both are, else letter by letter.
bool equal(const YAML::Node& value, const YAML::Node& wanted) {
  if (!value.IsScalar()) return false;
  const auto a = number_in(value), b = number_in(wanted);
  return a && b ? *a == *b : value.Scalar() == wanted.Scalar();
}

std::string listed_scalars(const YAML::Node& list) {
  std::string text;
  for (const auto& one : list) text += (text.empty() ? "" : ", ") + one.Scalar();
  return text;
}

std::string keys_of(const YAML::Node& map) {
  std::string text;
  for (const auto& entry : map) text += (text.empty() ? "" : ", ") + entry.first.Scalar();
  return text;
}

/// What a schema's type is called.
std::string called(const std::string& type) {
  if (type == "object") return "a map of `key: value` lines";
  if (type == "array") return "a list, e.g. [0, 1]";
  if (type == "number") return "a number";
  if (type == "integer") return "a whole number";
  return type == "boolean" ? "true or false" : "a text";
}

bool is_of_type(const YAML::Node& value, const std::string& type) {
  if (type == "object") return value.IsMap();
  if (type == "array") return value.IsSequence();
  const auto number = number_in(value);
  if (type == "number") return number.has_value();
  if (type == "integer") return number && *number == std::floor(*number);
  bool flag = false;
  return value.IsScalar() && (type != "boolean" || YAML::convert<bool>::decode(value, flag));
}

/// One place of the file and what the schema says of it.
struct Place {
  YAML::Node value;
  YAML::Mark mark;   ///< of its key
  std::string path;  ///< keys from the root, joined with dots
};

class Check {
 public:
  Check(const std::filesystem::path& file, const YAML::Node& schema) : file_(file), root_(schema) {}

  std::vector<FileProblem> problems;

  void at(const Place& place, const YAML::Node& given) {
    const YAML::Node schema = resolved(given);
    if (schema["anyOf"]) return any_of(place, schema);
    if (schema["type"] && !is_of_type(place.value, schema["type"].Scalar())) {
      const std::string found = place.value.IsScalar() ? ", not `" + place.value.Scalar() + "`" : "";
      return say(place, "must be " + called(schema["type"].Scalar()) + found, schema);
    }
    scalar(place, schema);
    if (place.value.IsMap()) map(place, schema);
    if (place.value.IsSequence()) list(place, schema);
    for (const auto& rule : schema["allOf"]) {
      if (holds(place.value, rule["if"])) at(place, rule["then"]);
    }
  }

 private:
  YAML::Node resolved(const YAML::Node& schema) const {
    constexpr std::string_view start = "#/definitions/";
    if (!schema["$ref"]) return schema;
    return root_["definitions"][schema["$ref"].Scalar().substr(start.size())];
  }

  void say(const Place& place, const std::string& what, const YAML::Node& schema) {
    const int line = std::max(place.mark.line + 1, 1);
    const std::string about = schema["description"] ? ": " + schema["description"].Scalar() : "";
    problems.push_back({line, file_.string() + ":" + std::to_string(line) + ": " +
                                  in_one_line(place.path + (place.path.empty() ? "" : " ") + what + about)});
  }

  /// One of several: the complaint is of the first, since the others are words in place of it.
  void any_of(const Place& place, const YAML::Node& schema) {
    std::string words;
    for (const auto& one : schema["anyOf"]) {
      Check alone(file_, root_);
      alone.at(place, one);
      if (alone.problems.empty()) return;
      words += words.empty() ? "" : " or ";
      words += one["enum"] ? listed_scalars(one["enum"]) : called(one["type"].Scalar());
    }
    say(place, "must be " + words, schema);
  }

  void scalar(const Place& place, const YAML::Node& schema) {
    if (schema["enum"]) {
      const YAML::Node words = schema["enum"];
      if (std::none_of(words.begin(), words.end(), [&](const YAML::Node& w) { return equal(place.value, w); })) {
        const std::string found = place.value.IsScalar() ? "is `" + place.value.Scalar() + "`" : "is no word";
        return say(place, found + ". Known: " + listed_scalars(words), schema);
      }
    }
    if (schema["not"] && schema["not"]["const"] && equal(place.value, schema["not"]["const"])) {
      return say(place, "must not be " + place.value.Scalar(), schema);
    }
    const auto number = number_in(place.value);
    if (!number) return;
    const auto bound = [&](const char* key) -> std::optional<double> {
      return schema[key] ? std::optional(schema[key].as<double>()) : std::nullopt;
    };
    const auto least = bound("minimum"), above = bound("exclusiveMinimum"), most = bound("maximum");
    std::ostringstream wanted;
    if (above && *number <= *above) wanted << "must be above " << *above;
    if ((least && *number < *least) || (most && *number > *most)) {
      wanted << "must be " << *least;
      most ? wanted << " to " << *most : wanted << " or more";
    }
    if (!wanted.str().empty()) say(place, "is " + place.value.Scalar() + ", but " + wanted.str(), schema);
  }

  void map(const Place& place, const YAML::Node& schema) {
    const YAML::Node known = schema["properties"];
    const YAML::Node others = schema["additionalProperties"];
    for (const auto& entry : place.value) {
      const std::string key = entry.first.IsNull() ? "null" : entry.first.Scalar();
      const Place below{entry.second, entry.first.Mark(), place.path + (place.path.empty() ? "" : ".") + key};
      if (known && known[key]) {
        at(below, known[key]);
      } else if (others && others.IsMap()) {
        at(below, others);
      } else if (others) {
        say(below, "is not known here. Known: " + keys_of(known), YAML::Node(YAML::NodeType::Map));
      }
    }
    for (const auto& needed : schema["required"]) {
      const std::string key = needed.Scalar();
      if (place.value[key]) continue;
      const Place missing{place.value, place.mark, place.path + (place.path.empty() ? "" : ".") + key};
      say(missing, "is missing", known && known[key] ? resolved(known[key]) : schema);
    }
    if (schema["minProperties"] && place.value.size() == 0) say(place, "is empty", schema);
  }

  void list(const Place& place, const YAML::Node& schema) {
    const std::size_t count = place.value.size();
    if ((schema["minItems"] && count < schema["minItems"].as<std::size_t>()) ||
        (schema["maxItems"] && count > schema["maxItems"].as<std::size_t>())) {
      say(place, "has " + std::to_string(count) + " values", schema);
    }
    for (const auto& item : place.value) {
      if (schema["items"]) at({item, place.mark, place.path}, schema["items"]);
    }
  }

  /// `if: {properties: {KEY: {const: WORD}}}`
  static bool holds(const YAML::Node& value, const YAML::Node& condition) {
    for (const auto& entry : condition["properties"]) {
      const YAML::Node found = value.IsMap() ? value[entry.first.Scalar()] : YAML::Node(YAML::NodeType::Undefined);
      if (!found.IsDefined() || !equal(found, entry.second["const"])) return false;
    }
    return true;
  }

  const std::filesystem::path& file_;
  YAML::Node root_;
};

}  // namespace

std::vector<FileProblem> schema_problems(const YamlMap& file, const std::filesystem::path& schema) {
  const YamlMap wanted = YamlMap::load(schema);  // JSON is YAML
  Check check(file.file(), wanted.node());
  check.at({file.node(), file.node().Mark(), ""}, wanted.node());
  std::ranges::stable_sort(check.problems, {}, &FileProblem::line);
  return check.problems;
}

}  // namespace emtb
