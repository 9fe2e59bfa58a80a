#pragma once

#include <map>
#include <string>

#include "hal/signal.h"

namespace emtb {

/// How the columns of somebody else's file become signals: `--map FILE`.
///
///     time: t_s
///     run: run                                  # optional: splits the file into runs
///     columns: {theta: {from: pos_m, scale: 1, offset: 0}, i_a: {from: u_V}}
///     window: {i_a: 0.4}                        # [s]
///     delimiter: ";"                            # optional, default ","
///     decimal: ","                              # optional, default "."
struct Mapping {
  struct Source {
    std::string column;
    double scale = 1;  ///< signal = scale * column + offset
    double offset = 0;
  };

  std::string time = "t_s";
  std::string run;                   ///< empty: the file is one run
  std::map<Signal, Source> columns;  ///< empty: the contract's own column names
  std::map<Signal, double> window;   ///< [s]
  char delimiter = ',';
  char decimal = '.';
};

}  // namespace emtb
