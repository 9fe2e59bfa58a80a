#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "session/csv_table.h"
#include "session/mapping.h"
#include "session/session.h"

namespace emtb {

/// Where a signal stands in a row.
struct CsvColumn {
  std::optional<std::size_t> cell;  ///< none: it is `offset` in every row
  Signal signal{};
  double scale = 1;
  double offset = 0;
  std::string name;
};

/// A column that says something of a signal's instrument: its cell is filled once a run.
struct CsvProperty {
  std::size_t cell = 0;
  Signal signal{};
  double Series::*what = nullptr;  ///< &Series::lsb or &Series::window
  std::string name;
};

/// What a column of an instrument's resolution is called, `i_a_lsb_A`, and that of its window, `i_a_window_s`.
std::string lsb_column(Signal signal);
std::string window_column(Signal signal);

/// May a column of that name be the time? `t`, `Time [ms]`, `seconds`
bool may_be_time(std::string_view column);

/// The signal and its unit, where a column's own name says both: `omega_rad_s`, `i_a_mA`.
struct NamedColumn {
  Signal signal{};
  std::string unit;
};
std::optional<NamedColumn> named_column(const std::string& column);

/// What the columns of a CSV file are.
struct CsvHeader {
  std::size_t width = 0;
  std::optional<std::size_t> time;  ///< the cell of the time; none: rows follow in even steps
  double time_scale = 1;
  double period = 0;  ///< [s] of these
  std::string time_name;
  std::optional<std::size_t> run;  ///< the cell of a run's name
  std::string run_name;            ///< of that column
  std::vector<CsvColumn> signals;
  std::vector<CsvProperty> properties;  ///< not where a mapping lists the columns
};

/// Reads the names of the columns.
/// @param table whose first line was read
/// @throws SessionError where the time or a mapped column is missing, or a column can be meant for a signal that the
/// file otherwise lacks
CsvHeader read_csv_header(const CsvTable& table, const Mapping& mapping);

}  // namespace emtb
