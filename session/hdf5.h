#pragma once

#include <filesystem>

#include "session/session.h"

namespace emtb {

/// Reads a session from HDF5:
///
///     /signals/NAME/t, value    s from the start of the file, SI; attributes unit, source, window [s], lsb
///     /events/t, code, text
///     /config                   the bench YAML, whole
///     attributes of /           format, started_utc, profile, bench, operator, note, software, complete
///
/// Only /signals must be there, so that a few lines of h5py or MATLAB can make a session. Signals that emtb does not
/// know are passed over; a unit other than SI is an error. Time never runs back in the file: an event with code
/// event_code::run marks where each run begins. The first run begins at time zero wherever its mark stands, so that
/// nothing falls before it; time is counted from there in each run. Events keep the file's time.
///
/// A session whose writer died, or still writes, is read up to the last flush, with complete = false.
/// @throws SessionError with file and object.
Session read_hdf5(const std::filesystem::path& path);

/// Writes such a file, all at once: what stood there before is replaced only when everything is written.
/// Run names are made distinct; where the session's own marks still fit its runs, they and with them the times of all
/// events are kept, otherwise runs are laid one behind the other, each at a whole
/// second, while events keep their times.
void write_hdf5(const std::filesystem::path& path, const Session& session);

}  // namespace emtb
