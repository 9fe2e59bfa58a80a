#include "drivers/program/message.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

namespace emtb::program {
namespace {

constexpr std::array faults{Fault::non_finite, Fault::over_range, Fault::device_lost, Fault::wrong_function};

template <class Number>
std::optional<Number> number_of(std::string_view text) noexcept {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Takes the first word away. @return it; empty: there is none
std::string_view next_word(std::string_view& line) noexcept {
  line.remove_prefix(std::min(line.find_first_not_of(' '), line.size()));
  const std::string_view word = line.substr(0, line.find(' '));
  line.remove_prefix(word.size());
  return word;
}

/// @return false where it has its value already, or there is none
bool set_once(std::optional<double>& to, std::optional<double> value) noexcept {
  if (to || !value || !std::isfinite(*value)) return false;
  to = value;
  return true;
}

}  // namespace

std::optional<Hello> read_hello(std::string_view line) {
  if (next_word(line) != "emtb") return std::nullopt;
  const auto version = number_of<int>(next_word(line));
  if (!version) return std::nullopt;
  Hello hello{.version = *version, .name = {}};
  line.remove_prefix(std::min(line.find_first_not_of(' '), line.size()));
  for (const char c : line.substr(0, 60)) hello.name.push_back(c >= ' ' && c <= '~' ? c : '?');
  return hello;
}

std::optional<Report> read_report(std::string_view line) noexcept {
  Report report;
  std::array<bool, signal_count> said{};
  bool any = false;
  for (std::string_view word = next_word(line); !word.empty(); word = next_word(line)) {
    const std::size_t equals = word.find('=');
    if (equals == std::string_view::npos) return std::nullopt;
    const std::string_view key = word.substr(0, equals);
    const auto value = number_of<double>(word.substr(equals + 1));
    any = true;
    if (key == "t" || key == "out") {
      if (!set_once(key == "t" ? report.time : report.out, value)) return std::nullopt;
      continue;
    }
    const auto signal = signal_named(key);
    if (!signal || !value || std::exchange(said[index(*signal)], true)) return std::nullopt;
    report.values[report.count++] = {.signal = *signal, .value = *value};
  }
  return any ? std::optional(report) : std::nullopt;
}

std::optional<Fault> read_fault(std::string_view line) noexcept {
  if (next_word(line) != "fault") return std::nullopt;
  const std::string_view name = next_word(line);
  const auto found =
      std::ranges::find_if(faults, [&](Fault fault) { return text(fault).substr(0, text(fault).find(':')) == name; });
  if (found == faults.end() || !next_word(line).empty()) return std::nullopt;
  return *found;
}

std::string set_line(double volts) {
  std::array<char, 32> buffer{};
  const auto [end, error] =
      std::to_chars(buffer.data(), buffer.data() + buffer.size(), volts, std::chars_format::general, 9);
  return "set " + std::string(buffer.data(), end) + "\n";
}

}  // namespace emtb::program
