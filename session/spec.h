#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "session/mapping.h"
#include "session/session.h"

namespace emtb {

/// A session as named on the command line: `PATH[#RUN][@T0:T1]`.
struct SessionSpec {
  std::filesystem::path path;
  std::string run;           ///< empty: all runs
  std::optional<double> t0;  ///< [s]
  std::optional<double> t1;  ///< [s]
};

/// @throws SessionError where the text is not of that form.
SessionSpec parse_session_spec(std::string_view text);

/// Reads a whole session, .csv or .h5 by its ending.
/// @throws SessionError with file and line (CSV) or object (HDF5).
Session read_session(const std::filesystem::path& path, const Mapping& mapping = {});

/// Reads the runs that a command line names, cut to their spans; time starts at zero in each.
/// @throws SessionError where the file, the run or the span does not exist or holds nothing.
std::vector<Run> read_runs(std::string_view spec, const Mapping& mapping = {});
/// Those of several, one after the other; texts are read side by side. Angles that begin anew with each turn are put
/// together.
std::vector<Run> read_runs(const std::vector<std::string>& specs, const Mapping& mapping);

/// The readings of t0 <= t < t1 [s], time starting at zero: half open, so that two spans that meet share none. The name
/// stays.
Run cut(const Run& run, double t0, double t1);

/// Writes by the ending: .csv or .h5.
void write_session(const std::filesystem::path& path, const Session& session);

}  // namespace emtb
