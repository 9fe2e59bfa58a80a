#include "paper/text.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "hal/error.h"

namespace emtb::paper {
namespace {

std::string filled(std::string_view text, const std::vector<std::string>& values) {
  std::string out;
  std::size_t next = 0;
  for (std::size_t at = 0; at < text.size(); ++at) {
    if (text.substr(at, 2) != "{}") {
      out += text[at];
      continue;
    }
    if (next == values.size()) throw Error("page: more places than values in: " + std::string(text));
    out += values[next++];
    ++at;
  }
  if (next != values.size()) throw Error("page: more values than places in: " + std::string(text));
  return out;
}

}  // namespace

std::string number(double value, int digits) {
  char text[64];
  const double size = std::abs(value);
  if (size > 0 && (size >= 1e6 || size < 1e-6)) {
    std::snprintf(text, sizeof text, "%.*g", digits, value);
    return text;
  }
  // Rounded to its digits, then written out: 0.00006, 32000.
  std::snprintf(text, sizeof text, "%.*e", digits - 1, value);
  const double rounded = std::strtod(text, nullptr);
  const int exponent = rounded == 0 ? 0 : static_cast<int>(std::floor(std::log10(std::abs(rounded)) + 1e-12));
  std::snprintf(text, sizeof text, "%.*f", std::max(0, digits - 1 - exponent), rounded);
  std::string out = text;
  if (out.find('.') == std::string::npos) return out;
  out.erase(out.find_last_not_of('0') + 1);
  if (out.back() == '.') out.pop_back();
  return out;
}

std::string change(double from, double to, int digits) {
  const double percent = 100 * (to / from - 1);
  return (percent < 0 ? "-" : "+") + number(std::abs(percent), digits) + " %";
}

std::string with_error(double value, double std_error) {
  if (!(std_error > 0)) return number(value, 5);
  // One digit of the error, two where it begins with 1; the value as far.
  const double exponent = std::floor(std::log10(std_error));
  const int more = std_error / std::pow(10, exponent) < 1.95 ? 1 : 0;
  const int decimals = std::max(0, more - static_cast<int>(exponent));
  char text[96];
  std::snprintf(text, sizeof text, "%.*f ± %.*f", decimals, value, decimals, std_error);
  return text;
}

void Markdown::heading(int level, std::string_view text) {
  if (!text_.empty()) text_ += "\n";
  text_ += std::string(static_cast<std::size_t>(level), '#') + " " + std::string(text) + "\n";
  in_list_ = false;
}

void Markdown::say(std::string_view text, const std::vector<std::string>& values) {
  text_ += (text_.empty() ? "" : "\n") + filled(text, values) + "\n";
  in_list_ = false;
}

void Markdown::bullet(std::string_view text, const std::vector<std::string>& values) {
  if (!in_list_) text_ += "\n";
  text_ += "- " + filled(text, values) + "\n";
  in_list_ = true;
}

void Markdown::table(const std::vector<std::vector<std::string>>& rows) {
  text_ += "\n";
  for (std::size_t r = 0; r < rows.size(); ++r) {
    for (const std::string& cell : rows[r]) text_ += "| " + cell + " ";
    text_ += "|\n";
    if (r > 0) continue;
    for (std::size_t c = 0; c < rows[r].size(); ++c) text_ += c == 0 ? "|---" : "|---:";
    text_ += "|\n";
  }
  in_list_ = false;
}

void Markdown::picture(const std::string& name, std::string_view alt) {
  text_ += "\n![" + std::string(alt) + "](pictures/paper/" + name + ".svg)\n";
  in_list_ = false;
}

}  // namespace emtb::paper
