#pragma once

#include <nlohmann/json.hpp>

#include "tools/page/recordings.h"

namespace emtb::page {

/// Sessions that are made of others. Each is a new file among the imports; what it was made of stays as it is.

/// A part of a session, `from` to `to` s of one run or of all. @return `{"path", "name"}` of the new one
json cut_session(const json& params, const Files& files, const Recordings& recordings, const Mapping& mapping);

/// The columns of a CSV file with their first cells, the signals that they may be, and the units of these.
json csv_columns(const json& params, const Recordings& recordings);

/// Reads a CSV file by a mapping, `map`, a text as a file of `--map` is. What was imported goes with its mapping into
/// the folder `raw` of the imports: the new session takes its place. @return `{"path", "name"}` of the new one
json map_csv(const json& params, const Files& files, const Recordings& recordings);

}  // namespace emtb::page
