#include "config/edit.h"

#include <algorithm>
#include <sstream>
#include <vector>

#include "hal/error.h"

namespace emtb {
namespace {

constexpr int digits = 6;  // of a calibration; five are worth something

struct Edit {
  std::size_t at;
  std::size_t length;
  std::string text;
};

std::string number_text(double value) {
  std::ostringstream text;
  text.precision(digits);
  text << value;
  return text.str();
}

/// yaml-cpp counts lines and columns; its count of bytes leaves out the carriage returns.
std::size_t place_of(const std::string& text, const YAML::Mark& mark) {
  std::size_t at = 0;
  for (int line = 0; line < mark.line; ++line) at = text.find('\n', at) + 1;
  return at + static_cast<std::size_t>(mark.column);
}

bool same(const YAML::Node& a, const YAML::Node& b) {
  if (!b.IsDefined() || a.Type() != b.Type() || a.size() != b.size()) return false;
  if (a.IsScalar()) return a.Scalar() == b.Scalar();
  if (a.IsSequence()) {
    for (std::size_t k = 0; k < a.size(); ++k) {
      if (!same(a[k], b[k])) return false;
    }
  }
  if (a.IsMap()) {
    for (const auto& entry : a) {
      const YAML::Node there = b[entry.first.Scalar()];
      if (!there || !same(entry.second, there)) return false;
    }
  }
  return true;
}

/// Without aliases: what two places share is then two things.
YAML::Node deep_copy(const YAML::Node& node) {
  if (node.IsScalar() || node.IsNull()) return YAML::Clone(node);
  YAML::Node copy(node.Type());
  if (node.IsSequence()) {
    for (const auto& item : node) copy.push_back(deep_copy(item));
  } else {
    for (const auto& entry : node) copy[entry.first.Scalar()] = deep_copy(entry.second);
  }
  return copy;
}

YAML::Node reread(const std::string& text) {
  try {
    return YAML::Load(text);
  } catch (const YAML::Exception&) {
    return YAML::Node(YAML::NodeType::Undefined);
  }
}

/// Writes the note into the comment of the line on which `at` stands.
void annotate(std::string& text, std::size_t at, const std::string& note) {
  std::size_t end = std::min(text.find('\n', at), text.size());
  if (end > at && text[end - 1] == '\r') --end;
  const std::string line = text.substr(at, end - at);
  const std::size_t comment = line.find(" #");
  const std::string word = note.substr(0, note.find(' '));
  if (comment == std::string::npos) {
    text.insert(end, "   # " + note);
    return;
  }
  const std::size_t older = line.find(word + " ", comment);
  if (older == std::string::npos) {
    text.insert(end, "; " + note);
  } else {
    text.replace(at + older, line.size() - older, note);
  }
}

}  // namespace

std::string edited(const std::string& text, const std::filesystem::path& name, std::span<const std::string> path,
                   std::span<const KeyedNumber> numbers, const std::string& note) {
  YamlMap map = YamlMap::parse(text, name.string());
  for (const std::string& key : path) map = map.map(key);
  const std::size_t start = place_of(text, map.node().Mark());
  const bool flow = start < text.size() && text[start] == '{';
  std::vector<Edit> edits;
  for (const auto& [key, value] : numbers) {
    if (map.has(key)) {
      const YAML::Node node = map.node()[key];
      const std::string old = node.Scalar();
      const std::size_t at = place_of(text, node.Mark());
      if (text.compare(at, old.size(), old) != 0)
        map.fail(key, "is written in a way that emtb cannot edit. Write a plain number");
      edits.push_back({at, old.size(), number_text(value)});
    } else if (flow) {
      edits.push_back({start + 1, 0, key + ": " + number_text(value) + ", "});
    } else {
      const auto indent = static_cast<std::size_t>(map.node().Mark().column);
      edits.push_back({start, 0, key + ": " + number_text(value) + "\n" + std::string(indent, ' ')});
    }
  }
  std::ranges::stable_sort(edits, std::ranges::greater(), &Edit::at);  // from the end: what is before stays in place
  std::string result = text;
  for (const Edit& edit : edits) result.replace(edit.at, edit.length, edit.text);
  annotate(result, edits.empty() ? start : edits.back().at, note);

  // Whatever the text looked like: it must read as before but for these numbers.
  YAML::Node wanted = deep_copy(YAML::Load(text));
  YAML::Node at = wanted;
  for (const std::string& key : path) at.reset(at[key]);
  for (const auto& [key, value] : numbers) at[key] = number_text(value);
  if (!same(wanted, reread(result)))
    map.fail("", "is written in a way that emtb cannot edit. Change it by hand: " + note);
  return result;
}

}  // namespace emtb
