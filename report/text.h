#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace emtb {

/// A number as people read it: `digits` significant ones, no trailing zeros; powers of ten only below 1e-4 and from
/// 1e6.
std::string pretty(double value, int digits = 4);

/// `0.0547 +- 0.0003 N m`, the value with as many digits as its error is worth.
std::string pretty(double value, double std_error, const std::string& unit);

/// Columns that line up; the first is left-aligned, the others right, or all of them left.
class Table {
 public:
  enum class Align { numbers, words };
  explicit Table(std::vector<std::string> heading, Align align = Align::numbers);
  void row(std::vector<std::string> cells);

  /// @param width of a line: columns that it has no room for follow below, each row behind its first cell again
  std::string text(const std::string& indent = "", std::size_t width = std::string::npos) const;

  /// [characters] of the longest line, where all columns stand side by side
  std::size_t width() const;

 private:
  std::vector<std::size_t> widths() const;  // of the columns

  Align align_;
  std::vector<std::vector<std::string>> rows_;
};

/// A word as a shell takes it.
std::string shell_quoted(const std::string& word);

/// `1 run`, `3 runs`.
std::string counted(std::size_t count, const std::string& what);

/// Prose in lines of at most `width` characters, broken at spaces, each with `indent` spaces before it; lines that the
/// text has stay. A word longer than a line stands whole on one of its own. No newline at the end.
std::string wrapped(const std::string& text, std::size_t width, std::size_t indent = 0);

/// A text of prose and tables for a terminal: prose is broken into lines of `width`, those that follow two spaces
/// further in; rows of tables, which hold two spaces in a row, stay.
std::string fitted(const std::string& text, std::size_t width);

/// A bar of at most `width` characters: to the right for positive shares (of 1), to the left of the middle for
/// negative.
std::string bar(double share, int width);

}  // namespace emtb
