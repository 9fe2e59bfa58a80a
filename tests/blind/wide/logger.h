#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "session/session.h"
#include "tests/blind/wide/bench.h"

namespace emtb::blind::wide {

/// What a logger wrote of one run, and what only the judge sees.
struct Recording {
  Run run;                                      ///< the file's signals
  std::vector<double> written;                  ///< [V] the reference of every row from the profile's start on
  std::map<Signal, std::vector<double>> ideal;  ///< per row, of each measured signal: without noise and steps; the
                                                ///< speed for an encoder, too
};

/// Runs an experiment on the bench's plant, row by row as somebody's logging script does: wait, read, write the
/// reference (or write, then read). The loop, if it is closed, acts on the readings.
/// @param seed of noise, jitter, the rotor's angle at the start and the model error
/// @param replay written instead of what profile or loop would write; empty: those
Recording record(const WideBench& bench, const Experiment& experiment, std::uint64_t seed,
                 const std::vector<double>& replay = {});

}  // namespace emtb::blind::wide
