#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "hal/error.h"

namespace emtb::blind {

/// A case that is asked for, by its kind and number.
template <class Kind>
struct WantedCase {
  Kind kind{};
  std::size_t number = 0;
  double share = 0;  ///< how far into its kind: kinds are mixed, so that an early end is a smaller sample of all

  std::string id() const { return std::string(name_of(kind)) + ":" + std::to_string(number); }
};

/// @param kind_named finds a kind by its name, or nothing @param kinds that there are, for people
/// @throws Error where the text is no KIND:NUMBER
template <class Kind>
WantedCase<Kind> wanted_from(const std::string& text, std::optional<Kind> (*kind_named)(std::string_view),
                             const std::string& kinds) {
  const auto colon = text.find(':');
  const auto kind = kind_named(text.substr(0, colon));
  const bool digits = colon != std::string::npos && colon + 1 < text.size() &&
                      text.find_first_not_of("0123456789", colon + 1) == std::string::npos;
  if (!kind || !digits) throw Error("`" + text + "` is no KIND:NUMBER. Kinds: " + kinds + "; e.g. single:40");
  return {*kind, std::stoul(text.substr(colon + 1)), 0};
}

/// The cases of a list `single:40,healthy:20`, so many of each kind, mixed; or those of `only` alone, as they stand.
template <class Kind>
std::vector<WantedCase<Kind>> case_list(const std::vector<std::string>& only, const std::string& cases,
                                        std::optional<Kind> (*kind_named)(std::string_view), const std::string& kinds) {
  std::vector<WantedCase<Kind>> list;
  for (const std::string& id : only) list.push_back(wanted_from(id, kind_named, kinds));
  if (!only.empty()) return list;
  std::istringstream items(cases);
  for (std::string item; std::getline(items, item, ',');) {
    const auto last = wanted_from(item, kind_named, kinds);
    for (std::size_t n = 0; n < last.number; ++n) {
      list.push_back({last.kind, n, (static_cast<double>(n) + 0.5) / static_cast<double>(last.number)});
    }
  }
  std::ranges::stable_sort(list, {}, &WantedCase<Kind>::share);
  return list;
}

/// The answers of a file; a line that was cut off by a kill is none.
/// @param from reads one of its line
template <class Answer>
std::map<std::string, Answer> answers_in(const std::filesystem::path& file, Answer (*from)(const std::string&)) {
  std::map<std::string, Answer> answers;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    try {
      Answer a = from(line);
      answers[a.id] = std::move(a);
    } catch (const Error&) {
      std::cerr << file.string() << ": left out a line that was cut off\n";
    }
  }
  return answers;
}

/// One line in one write: what another process appends cannot get in between, and a kill leaves all or the start of it.
template <class Answer>
void append(const std::filesystem::path& file, const Answer& answer) {
  const std::string line = to_json_line(answer) + "\n";
  const int fd = open(file.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0644);
  if (fd < 0 || write(fd, line.data(), line.size()) != static_cast<ssize_t>(line.size())) {
    throw Error(file.string() + ": cannot be written. Give another --out");
  }
  close(fd);
}

}  // namespace emtb::blind
