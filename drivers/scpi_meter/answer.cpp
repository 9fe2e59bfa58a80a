#include "drivers/scpi_meter/answer.h"

#include <regex.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <memory>

#include "drivers/serial_meter/decimal.h"

namespace emtb::scpi_meter {

using serial_meter::Message;
using serial_meter::Quantity;
using serial_meter::trimmed;

/// Compiled once. POSIX: its time grows with the line alone, as long as it has no back-references.
struct Place::Pattern {
  Pattern() = default;
  ~Pattern() {
    if (compiled) regfree(&expression);
  }
  Pattern(const Pattern&) = delete;
  Pattern& operator=(const Pattern&) = delete;

  regex_t expression{};
  bool compiled = false;
};

std::optional<Place> Place::pattern(const std::string& pattern, std::string& why) {
  constexpr std::size_t longest = 100;
  for (std::size_t at = pattern.find('\\'); at + 1 < pattern.size(); at = pattern.find('\\', at + 2)) {
    if (serial_meter::is_digit(pattern[at + 1])) {
      why = "a back-reference is not taken";
      return std::nullopt;
    }
  }
  if (pattern.empty() || pattern.size() > longest) {
    why = "it may have 1 to 100 characters";
    return std::nullopt;
  }
  auto made = std::make_shared<Pattern>();
  const int error = regcomp(&made->expression, pattern.c_str(), REG_EXTENDED);
  made->compiled = error == 0;
  if (error == 0) return Place(0, '\0', std::move(made));
  std::array<char, 128> text{};
  regerror(error, &made->expression, text.data(), text.size());
  why = text.data();
  return std::nullopt;
}

std::optional<std::string_view> Place::in(std::string_view line) const {
  if (pattern_) {
    std::array<regmatch_t, 2> match{};
    match[0].rm_eo = static_cast<regoff_t>(line.size());  // REG_STARTEND: the line ends there
    if (regexec(&pattern_->expression, line.data(), match.size(), match.data(), REG_STARTEND) != 0) return std::nullopt;
    const regmatch_t& found = match[1].rm_so >= 0 ? match[1] : match[0];
    return line.substr(static_cast<std::size_t>(found.rm_so), static_cast<std::size_t>(found.rm_eo - found.rm_so));
  }
  for (std::size_t n = 1; n < field_; ++n) {
    const std::size_t end = line.find(separator_);
    if (end == std::string_view::npos) return std::nullopt;
    line.remove_prefix(end + 1);
  }
  return line.substr(0, line.find(separator_));
}

std::optional<double> number_of(std::string_view text) noexcept {
  text = trimmed(text);
  if (text.starts_with('+')) {
    text.remove_prefix(1);
    if (text.starts_with('-')) return std::nullopt;
  }
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

Message Answers::classify(std::string_view line) const {
  line = trimmed(line);
  if (line.empty()) return {.kind = Message::Kind::noise};
  if (!mode.empty() && line == mode) return {.kind = Message::Kind::function};
  const bool named = (line[0] >= 'A' && line[0] <= 'Z') || (line[0] >= 'a' && line[0] <= 'z');
  if (identity.empty() ? named && std::ranges::count(line, ',') >= 3 : line.starts_with(identity)) {
    return {.kind = Message::Kind::prompt};
  }
  if (const auto text = place.in(line)) {
    if (const auto value = number_of(*text)) {
      const bool overloaded = std::abs(*value) >= overload;
      return {.kind = Message::Kind::reading,
              .measurement = {.value = overloaded ? 0 : *value, .overload = overloaded}};
    }
  }
  // Where the mode is asked for, a line that is no number is another mode.
  if (!mode.empty()) return {.kind = Message::Kind::function, .measurement = {.quantity = Quantity::other}};
  return {.kind = Message::Kind::noise};
}

}  // namespace emtb::scpi_meter
