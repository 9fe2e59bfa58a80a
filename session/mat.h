#pragma once

#include <filesystem>

#include "session/mapping.h"
#include "session/session.h"

namespace emtb {

/// Two kinds of file that MATLAB reads. Octave reads the first; the second is HDF5 and has no limit of 2 GB.
enum class MatVersion { v5, v73 };

/// Reads a session from a .mat of either kind.
///
///     runs(k).name, .field_on, .signals.NAME.t, .value        s from the start of the run, SI
///                              .signals.NAME.unit, .window, .lsb, .source
///     events.t, .code, .text     format, config     attributes.NAME
///
/// Only `runs` must be there, or a `signals` alone for a single run. A .mat of somebody else has vectors of one length:
/// they are columns, called as in a CSV (`t_s`, `omega_rad_s`), or as a mapping says: `from: data.speed` for a field of
/// a struct, `from: y(:,2)` for a column of a matrix. NaN is no reading.
/// @throws SessionError with file and variable.
Session read_mat(const std::filesystem::path& path, const Mapping& mapping = {});

/// Writes such a file; what stood there before is replaced only when everything is written.
void write_mat(const std::filesystem::path& path, const Session& session, MatVersion version = MatVersion::v5);

}  // namespace emtb
