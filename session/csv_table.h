#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace emtb {

/// The rows of a CSV text, cell by cell.
class CsvTable {
 public:
  /// @param path for messages @param text outlives the table, whose cells are views into it
  /// @throws SessionError where it is UTF-16
  CsvTable(const std::filesystem::path& path, std::string_view text, char delimiter);

  /// Reads the next line that is not blank. @return false at the end
  bool next();

  /// Without the spaces and the quotes around them; see unescaped().
  const std::vector<std::string_view>& cells() const { return cells_; }

  bool ends_in_newline() const { return ends_in_newline_; }

  /// About how many rows are still to come: as many as lines of the length of the next ones would be.
  std::size_t rows_to_come() const;

  /// @throws SessionError with the file and the line that was read last
  [[noreturn]] void fail(const std::string& what) const;

 private:
  bool blank(char c) const { return (c == ' ' || c == '\t') && c != delimiter_; }
  std::string_view trimmed(std::string_view text) const;
  void split();
  const char* quoted(const char* p, const char* end);

  const std::filesystem::path& path_;
  std::string_view rest_;
  char delimiter_;
  std::string_view text_;
  std::vector<std::string_view> cells_;
  std::size_t line_ = 0;
  bool ends_in_newline_ = false;
};

/// A cell as it was meant: within a quoted one a quote is written twice.
std::string unescaped(std::string_view cell);

/// Reads numbers with a point or a comma.
class CsvNumbers {
 public:
  CsvNumbers(const CsvTable& table, char decimal) : table_(table), decimal_(decimal) {}

  /// @throws SessionError with the line and the column where the cell is no finite number
  double parse(std::string_view cell, const std::string& column) const;

 private:
  [[noreturn]] void refuse(std::string_view cell, const std::string& column, bool number) const;

  const CsvTable& table_;
  char decimal_;
};

}  // namespace emtb
