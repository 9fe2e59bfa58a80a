#include "session/csv_table.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "hal/error.h"
#include "session/text.h"

namespace emtb {

CsvTable::CsvTable(const std::filesystem::path& path, std::string_view text, char delimiter)
    : path_(path), rest_(text), delimiter_(delimiter) {
  if (rest_.starts_with("\xEF\xBB\xBF")) rest_.remove_prefix(3);
  if (rest_.starts_with("\xFF\xFE") || rest_.starts_with("\xFE\xFF")) {
    throw SessionError(path_.string() + ": is UTF-16 text. Save it as CSV in UTF-8");
  }
}

bool CsvTable::next() {
  do {
    if (rest_.empty()) return false;
    ++line_;
    const std::size_t end = std::min(rest_.find('\n'), rest_.size());
    text_ = rest_.substr(0, end);
    ends_in_newline_ = end < rest_.size();
    rest_.remove_prefix(ends_in_newline_ ? end + 1 : end);
    if (text_.ends_with('\r')) text_.remove_suffix(1);
  } while (trimmed(text_).empty());
  split();
  return true;
}

std::size_t CsvTable::rows_to_come() const {
  const std::string_view next = rest_.substr(0, std::size_t{1} << 14);
  const auto lines = static_cast<std::size_t>(std::ranges::count(next, '\n')) + 1;
  return rest_.size() / std::max<std::size_t>(1, next.size() / lines);
}

void CsvTable::fail(const std::string& what) const {
  throw SessionError(path_.string() + ":" + std::to_string(line_) + ": " + what);
}

std::string_view CsvTable::trimmed(std::string_view text) const {
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

void CsvTable::split() {
  cells_.clear();
  const char* p = text_.data();
  const char* const end = p + text_.size();
  while (true) {
    while (p != end && blank(*p)) ++p;
    if (p != end && *p == '"') {
      p = quoted(p + 1, end);
    } else {
      const char* const begin = p;
      while (p != end && *p != delimiter_) ++p;
      cells_.push_back(trimmed({begin, static_cast<std::size_t>(p - begin)}));
    }
    if (p == end) return;
    ++p;
  }
}

/// @param p behind the opening quote @return the delimiter behind the cell, or the end
const char* CsvTable::quoted(const char* p, const char* end) {
  const char* const begin = p;
  while (p != end && !(*p == '"' && !(p + 1 != end && p[1] == '"'))) p += *p == '"' ? 2 : 1;
  if (p == end) fail("a quote is opened but not closed on this line");
  cells_.emplace_back(begin, static_cast<std::size_t>(p - begin));
  ++p;
  while (p != end && blank(*p)) ++p;
  if (p != end && *p != delimiter_) fail("text follows the closing quote of `" + shown(cells_.back()) + "`");
  return p;
}

std::string unescaped(std::string_view cell) {
  std::string out;
  for (std::size_t i = 0; i < cell.size(); ++i) {
    out += cell[i];
    if (cell[i] == '"' && i + 1 < cell.size() && cell[i + 1] == '"') ++i;
  }
  return out;
}

double CsvNumbers::parse(std::string_view cell, const std::string& column) const {
  std::string pointed;
  std::string_view text = cell;
  if (text.starts_with('+')) text.remove_prefix(1);
  if (decimal_ != '.') {
    if (text.find('.') != std::string_view::npos) refuse(cell, column, false);
    pointed = text;
    std::ranges::replace(pointed, decimal_, '.');
    text = pointed;
  }
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool whole = end == text.data() + text.size() && !text.empty();
  if (whole && error == std::errc() && std::isfinite(value)) return value;
  refuse(cell, column, whole);
}

void CsvNumbers::refuse(std::string_view cell, const std::string& column, bool number) const {
  const std::string what = "column " + shown(column) + ": `" + shown(cell) + "` is not ";
  if (number) table_.fail(what + "a finite number. Leave the cell empty where there is no reading");
  std::string hint = "Leave the cell empty where there is no reading";
  if (decimal_ != '.') hint = std::string("The mapping says decimal: \"") + decimal_ + "\"";
  if (decimal_ == '.' && cell.find(',') != std::string_view::npos)
    hint = "For decimal commas say so with --map, decimal: \",\"";
  table_.fail(what + "a number. " + hint);
}

}  // namespace emtb
