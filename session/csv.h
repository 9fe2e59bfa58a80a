#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "hal/signal.h"
#include "session/mapping.h"
#include "session/session.h"

namespace emtb {

/// Reads a CSV file: one row a point in time, one column a signal, an empty cell where a signal has no reading (never
/// interpolated).
///
/// Without a mapping the columns are the contract's (`t_s`, `omega_rad_s` ..., hal/signal.h), in any order; a column
/// `run` splits the file into runs. With a mapping that lists columns, exactly those are read. All other columns are
/// passed over, but for one trap: a column that can be meant for a signal that the file otherwise lacks is an error
/// that says so, since leaving it out in silence would change the result. Such is a column that differs from the
/// contract's by case and punctuation or (from five letters on) by one letter, and a signal's name alone or with
/// another unit: `i_a`, `omega_rpm`, `theta_deg`; but not `omega_ref`.
///
/// What an instrument can tell apart and over what time it averages stand in columns of their own, `i_a_lsb_A` and
/// `i_a_window_s`, filled in one row of each run; a mapping that lists columns passes them over.
///
/// Runs stand in the order of their first row, and time is counted from the first row of each. Within a run it must
/// increase. Byte-order mark, CR LF, blank lines, spaces around cells and quoted cells (on one line) are understood.
/// @throws SessionError with file, line, column and what would be right.
Session read_csv(const std::filesystem::path& path, const Mapping& mapping = {});

/// The same of a text. @param path for messages
Session read_csv_text(const std::filesystem::path& path, const std::string& text, const Mapping& mapping);

/// What a person looks at who says which column is which.
struct CsvHead {
  struct Column {
    std::string name;
    std::vector<std::string> cells;  ///< below it, as they stand in the file
    bool is_time = false;            ///< its name may well mean the time
    std::optional<Signal> signal;    ///< as its own name says, unit and all: `omega_rad_s`, `i_a_mA`
    std::string unit;                ///< of that
  };
  char delimiter = ',', decimal = '.';  ///< as the file shows
  std::vector<Column> columns;
};

/// Reads the names of the columns and the first rows, of however large a file.
/// @throws SessionError where there is no line of names
CsvHead read_csv_head(const std::filesystem::path& path, std::size_t rows);

/// Writes the contract's columns: a row for each time at which any signal has a reading, empty cells for the others,
/// the shortest digits that read back the same. Several runs: a column `run`. Where a
/// resolution or a window is known, a column for it behind the signals, with the value in the first row of each run:
/// any program reads such a file without being told of them. Events and attributes have no place in a CSV.
void write_csv(const std::filesystem::path& path, const Session& session);

}  // namespace emtb
