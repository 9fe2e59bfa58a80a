#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace emtb {

/// A column of a table of results: numbers (NaN where there is none) or texts.
struct TableColumn {
  std::string name;
  std::string unit;
  std::vector<double> numbers;
  std::vector<std::string> texts;  ///< in place of numbers
};

/// Writes a table as HDF5: `/table/NAME`, one dataset a column, float64 with the attribute `unit`, or UTF-8 strings. It
/// takes the place of an older file all at once.
/// @param attributes of the file
/// @throws SessionError where it cannot be written
void write_table(const std::filesystem::path& path, const std::vector<TableColumn>& columns,
                 const std::map<std::string, std::string>& attributes);

}  // namespace emtb
