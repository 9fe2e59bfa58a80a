#pragma once

#include <map>
#include <string>

#include "hal/signal.h"

namespace emtb {

/// How the columns of somebody else's file become signals: `--map FILE`.
///
///     time: t_s
///     time_unit: ms                             # optional, default s; or time: {from: t_ms, unit: ms}
///     period: 0.02                              # [s] from row to row, in place of a time that no column holds
///     run: run                                  # optional: splits the file into runs
///     columns: {theta: {from: pos_m, scale: 1, offset: 0}, omega: {from: n, unit: rpm}, u_ref: {value: 6}}
///     window: {i_a: 0.4}                        # [s]
///     delimiter: ";"                            # optional, default: as the file shows
///     decimal: ","                              # optional, default: as the file shows
struct Mapping {
  struct Source {
    std::string column;
    double scale = 1;  ///< signal = scale * column + offset; units are in it already
    double offset = 0;
    bool constant = false;  ///< no column: `offset` in every row
  };

  std::string time = "t_s";
  double time_scale = 1;             ///< [s]
  double period = 0;                 ///< [s] from row to row; 0: a column holds the time
  std::string run;                   ///< empty: the file is one run
  std::map<Signal, Source> columns;  ///< empty: the contract's own column names
  std::map<Signal, double> window;   ///< [s]
  char delimiter = '\0';             ///< NUL: as the file shows
  char decimal = '\0';
};

}  // namespace emtb
