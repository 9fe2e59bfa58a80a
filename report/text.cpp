#include "report/text.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <sstream>

#include "hal/printable.h"
#include "hal/unit.h"

namespace emtb {
namespace {

constexpr std::size_t gap = 2;  // between columns

/// Characters as a terminal shows them: continuation bytes of UTF-8 take no room.
std::size_t width_of(const std::string& text) {
  return static_cast<std::size_t>(std::ranges::count_if(text, [](char c) { return (c & 0xC0) != 0x80; }));
}

}  // namespace

std::string pretty(double value, int digits) {
  if (!std::isfinite(value)) return "-";
  char text[48];
  std::snprintf(text, sizeof text, "%.*g", digits, value);
  constexpr double whole = 1e6;  // up to there 120 reads better than 1.2e+02
  const double rounded = std::strtod(text, nullptr);
  if (std::abs(rounded) < whole && std::string_view(text).find("e+") != std::string_view::npos) {
    std::snprintf(text, sizeof text, "%.0f", rounded);
  }
  return text;
}

std::string counted(std::size_t count, const std::string& what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

std::string wrapped(const std::string& text, std::size_t width, std::size_t indent) {
  const std::string margin(indent, ' ');
  std::string out;
  std::istringstream lines(text);
  for (std::string given; std::getline(lines, given);) {
    std::istringstream words(given);
    std::string line;
    std::string word;
    while (words >> word) {
      if (!line.empty() && indent + width_of(line) + 1 + width_of(word) > width) {
        out += (out.empty() ? "" : "\n") + margin + line;
        line.clear();
      }
      line += (line.empty() ? "" : " ") + word;
    }
    out += (out.empty() ? "" : "\n") + (line.empty() ? "" : margin + line);
  }
  return out;
}

std::string pretty(double value, double std_error, const std::string& unit) {
  const double relative = value != 0 && std_error > 0 ? std_error / std::abs(value) : 1e-3;
  const int digits = std::clamp(static_cast<int>(std::ceil(-std::log10(relative))) + 1, 2, 7);
  return pretty(value, digits) + " +- " + pretty(std_error, 2) + with_space(unit);
}

std::string fitted(const std::string& text, std::size_t width) {
  std::string out;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t margin = std::min(line.find_first_not_of(' '), line.size());
    const bool row = line.find("  ", margin) != std::string::npos;
    if (row || width_of(line) <= width) {
      out += line + "\n";
      continue;
    }
    const std::string broken = wrapped(line, width - 2, margin);
    for (std::size_t i = 0; i < broken.size(); ++i) {
      out += broken[i];
      if (broken[i] == '\n') out += "  ";
    }
    out += "\n";
  }
  return out;
}

Table::Table(std::vector<std::string> heading, Align align) : align_(align) { row(std::move(heading)); }

void Table::row(std::vector<std::string> cells) {
  for (std::string& cell : cells) cell = printable(cell);
  rows_.push_back(std::move(cells));
}

std::vector<std::size_t> Table::widths() const {
  std::vector<std::size_t> widths;
  for (const auto& cells : rows_) {
    widths.resize(std::max(widths.size(), cells.size()));
    for (std::size_t i = 0; i < cells.size(); ++i) widths[i] = std::max(widths[i], width_of(cells[i]));
  }
  return widths;
}

std::size_t Table::width() const {
  std::size_t sum = 0;
  for (const std::size_t width : widths()) sum += (sum > 0 ? gap : 0) + width;
  return sum;
}

std::string Table::text(const std::string& indent, std::size_t width) const {
  const std::vector<std::size_t> widths = this->widths();
  std::string out;
  std::size_t begin = 1;  // of the columns that stand side by side behind the first
  do {
    std::size_t room = indent.size() + widths.front(), end = begin;
    while (end < widths.size() && (end == begin || room + gap + widths[end] <= width)) room += gap + widths[end++];
    for (const auto& cells : rows_) {
      const auto padded = [&](std::size_t i, bool left) {
        const std::string space(widths[i] - width_of(cells[i]), ' ');
        return left ? cells[i] + space : space + cells[i];
      };
      std::string line = indent + padded(0, true);
      bool any = begin == 1;  // below, a row that has nothing to say there is left out
      for (std::size_t i = begin; i < std::min(end, cells.size()); ++i) {
        line += std::string(gap, ' ') + padded(i, align_ == Align::words);
        any = any || !cells[i].empty();
      }
      line.erase(line.find_last_not_of(' ') + 1);
      if (any) out += line + "\n";
    }
    begin = end;
  } while (begin < widths.size());
  return out;
}

std::string shell_quoted(const std::string& word) {
  if (!word.empty() && word.find_first_of(" \t\n\"'`$&|;<>()*?[]{}#!~\\") == std::string::npos) return word;
  std::string out = "'";
  for (const char c : word) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

std::string bar(double share, int width) {
  const int half = width / 2;
  const int length = std::clamp(static_cast<int>(std::lround(std::abs(share) * half)), 0, half);
  const std::string filled(static_cast<std::size_t>(length), '#'), rest(static_cast<std::size_t>(half - length), ' ');
  const std::string empty(static_cast<std::size_t>(half), ' ');
  return share < 0 ? rest + filled + "|" + empty : empty + "|" + filled + rest;
}

}  // namespace emtb
