#include "session/hdf5.h"

#include "hal/error.h"

namespace emtb {

Session read_hdf5(const std::filesystem::path& path) {
  throw SessionError(path.string() + ": HDF5 cannot be read yet. Use .csv");
}

void write_hdf5(const std::filesystem::path& path, const Session&) {
  throw SessionError(path.string() + ": HDF5 cannot be written yet. Use .csv");
}

}  // namespace emtb
