#include "session/field.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>

#include "session/text.h"

namespace emtb {
namespace {

constexpr std::string_view before = "the field has been on for ";
constexpr std::string_view after = " s";

}  // namespace

std::string field_words(double seconds) {
  return std::string(before) + shortest(std::round(seconds * 1e3) / 1e3) + std::string(after);
}

std::optional<double> field_seconds(const Event& event) {
  const std::string_view text = event.text;
  if (event.code != event_code::field || !text.starts_with(before) || !text.ends_with(after)) return std::nullopt;
  const std::string_view number = text.substr(before.size(), text.size() - before.size() - after.size());
  double seconds = 0;
  const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), seconds);
  if (error != std::errc() || end != number.data() + number.size() || !std::isfinite(seconds)) return std::nullopt;
  return std::max(0.0, seconds);
}

}  // namespace emtb
