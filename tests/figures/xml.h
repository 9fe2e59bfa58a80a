#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

namespace emtb {

/// What is wrong with a piece of XML without declarations and comments; empty: it is well formed. Tags must match,
/// attributes be quoted and unique, & and < escaped.
inline std::string xml_error(std::string_view xml) {
  std::vector<std::string> open;
  const auto near = [&](std::size_t at) { return " near `" + std::string(xml.substr(at, 40)) + "`"; };
  const auto entities_closed = [](std::string_view text) {
    for (std::size_t i = text.find('&'); i != std::string_view::npos; i = text.find('&', i + 1)) {
      const std::size_t end = text.find(';', i);
      if (end == std::string_view::npos || end - i > 6) return false;
    }
    return true;
  };
  for (std::size_t i = 0; i < xml.size();) {
    if (xml[i] != '<') {
      const std::size_t end = std::min(xml.find('<', i), xml.size());
      if (!entities_closed(xml.substr(i, end - i))) return "an & that is no entity" + near(i);
      if (open.empty() && xml.substr(i, end - i).find_first_not_of(" \n") != std::string_view::npos)
        return "text outside the root" + near(i);
      i = end;
      continue;
    }
    std::size_t end = i + 1;
    bool quoted = false;
    for (; end < xml.size() && (quoted || xml[end] != '>'); ++end) {
      if (xml[end] == '"') quoted = !quoted;
      if (xml[end] == '<') return "a < within a tag" + near(i);
    }
    if (end == xml.size()) return "a tag without an end" + near(i);
    std::string_view tag = xml.substr(i + 1, end - i - 1);
    if (tag.starts_with('/')) {
      if (open.empty() || open.back() != tag.substr(1)) return "an end without its beginning" + near(i);
      open.pop_back();
    } else {
      const bool alone = tag.ends_with('/');
      if (alone) tag.remove_suffix(1);
      const std::size_t name_end = std::min(tag.find_first_of(" \n"), tag.size());
      if (name_end == 0) return "a tag without a name" + near(i);
      std::vector<std::string> names;
      for (std::string_view rest = tag.substr(name_end); rest.find_first_not_of(" \n") != std::string_view::npos;) {
        rest.remove_prefix(rest.find_first_not_of(" \n"));
        const std::size_t equals = rest.find("=\"");
        const std::size_t close = equals == std::string_view::npos ? equals : rest.find('"', equals + 2);
        if (close == std::string_view::npos) return "an attribute without a quoted value" + near(i);
        names.emplace_back(rest.substr(0, equals));
        if (std::count(names.begin(), names.end(), names.back()) > 1) return "an attribute twice" + near(i);
        if (!entities_closed(rest.substr(equals + 2, close - equals - 2))) return "an & that is no entity" + near(i);
        rest.remove_prefix(close + 1);
      }
      if (!alone) open.emplace_back(tag.substr(0, name_end));
    }
    i = end + 1;
  }
  return open.empty() ? "" : "no end of <" + open.back() + ">";
}

}  // namespace emtb
