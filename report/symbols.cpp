#include "report/symbols.h"

#include <algorithm>
#include <cctype>
#include <cstring>

#include "hal/unit.h"

namespace emtb {
namespace {

std::string greek(const std::string& word) {
  if (word == "omega") return "ω";
  if (word == "theta") return "θ";
  if (word == "tau") return "τ";
  return word;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
  return text;
}

}  // namespace

std::string symbol_of(Signal signal) {
  switch (signal) {
    case Signal::torque:
    case Signal::temperature:
      return std::string(info(signal).name);
    case Signal::armature_open:
      return "armature open";
    default:
      return symbol_of(std::string(info(signal).name));
  }
}

std::string compared_symbol(Signal signal) { return signal == Signal::theta ? "Δθ" : symbol_of(signal); }

std::string symbol_of(const std::string& parameter) {
  const std::size_t dot = parameter.find('.');
  const std::string own = dot == std::string::npos ? parameter : parameter.substr(dot + 1);
  const std::size_t bar = own.find('_');
  const std::string head = greek(own.substr(0, bar));
  const std::string symbol = bar == std::string::npos ? head : head + "_{" + own.substr(bar + 1) + "}";
  return dot == std::string::npos ? symbol : symbol + " (" + parameter.substr(0, dot) + ")";
}

std::string printed_unit(std::string_view unit) {
  if (unit == "ohm") return "Ω";
  if (unit == "degC") return "°C";
  std::string text = shown_unit(unit);
  for (const char* square : {"m2", "rad2", "s2"})
    text = replaced(text, square, std::string(square, std::strlen(square) - 1) + "²");
  return replaced(text, " ", "\u00a0");  // a unit does not break
}

std::string short_name(const std::string& run) {
  const std::size_t file_end = std::min(run.rfind(".csv"), run.rfind(".h5"));
  const std::size_t slash = run.rfind('/', file_end == std::string::npos ? run.size() : file_end);
  return slash == std::string::npos ? run : run.substr(slash + 1);
}

std::string file_name(const std::string& text) {
  std::string name;
  for (const char c : text) {
    const bool plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '-' || c == '_';
    if (plain || (!name.empty() && name.back() != '_')) name += plain ? c : '_';
  }
  while (!name.empty() && name.back() == '_') name.pop_back();
  return name;
}

}  // namespace emtb
