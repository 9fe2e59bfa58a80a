#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tools/batch/manifest.h"

namespace emtb {

/// A row of the table: what came of one motor.
struct BatchRow {
  std::string serial, time, sessions;
  std::string state;    ///< `done` or `bad`
  std::string message;  ///< why it is bad
  std::string verdict, missing;
  std::optional<double> error_train, error_held_out;
  struct Value {
    std::string name, unit;
    double value = 0;
    std::optional<double> std_error;
  };
  std::vector<Value> values;
  std::vector<std::string> beyond;  ///< limits that it does not keep: `K_b 0.0447 is above 0.044`
  bool passes = false;              ///< done, and within all limits

  const Value* find(const std::string& name) const;
  /// The error that counts: held-out where there is one.
  std::optional<double> error() const { return error_held_out ? error_held_out : error_train; }
};

/// What came of all, in the order of the manifest.
struct BatchTable {
  std::string name, work;
  std::vector<BatchLimit> limits;
  std::vector<BatchRow> rows;

  std::size_t passed() const;
  std::size_t bad() const;
  std::vector<std::pair<std::string, std::string>> parameters() const;  ///< names and units, of all rows
};

/// @param results as work_on() made them, in the order of the manifest
BatchTable make_table(const Manifest& manifest, const std::vector<nlohmann::ordered_json>& results);

/// Writes FOLDER/table.csv, FOLDER/table.h5 and FOLDER/index.html. @throws Error where one cannot be written
void write_tables(const BatchTable& table, const std::filesystem::path& folder);

/// Puts a text in the place of a file all at once.
void replace_with_text(const std::filesystem::path& file, const std::string& text);

/// The page: parameters over serial number and time, limits, pass and fail.
std::string page_of(const BatchTable& table);

}  // namespace emtb
