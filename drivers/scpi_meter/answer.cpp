#include "drivers/scpi_meter/answer.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <memory>
#include <regex>

#include "drivers/serial_meter/decimal.h"

namespace emtb::scpi_meter {

using serial_meter::Message;
using serial_meter::Quantity;
using serial_meter::trimmed;

/// Compiled once.
struct Place::Pattern {
  std::regex expression;
};

std::optional<Place> Place::pattern(const std::string& pattern, std::string& why) {
  constexpr std::size_t longest = 100;
  // The library's own engine whose time grows with the line alone, and which has no back-references: the usual one
  // tries 2^n ways with (a+)+b, and so does that of the C library.
  constexpr auto bounded = std::regex::ECMAScript | std::regex_constants::__polynomial;
  if (pattern.empty() || pattern.size() > longest) {
    why = "it may have 1 to 100 characters";
    return std::nullopt;
  }
  try {
    return Place(0, '\0', std::make_shared<const Pattern>(std::regex(pattern, bounded)));
  } catch (const std::regex_error& e) {
    why = e.what();
    return std::nullopt;
  }
}

std::optional<std::string_view> Place::in(std::string_view line) const {
  if (pattern_) {
    std::cmatch match;
    if (!std::regex_search(line.data(), line.data() + line.size(), match, pattern_->expression)) return std::nullopt;
    const auto& found = match.size() > 1 && match[1].matched ? match[1] : match[0];
    return std::string_view(found.first, static_cast<std::size_t>(found.length()));
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
