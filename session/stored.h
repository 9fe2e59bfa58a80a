#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "hal/signal.h"
#include "session/h5.h"
#include "session/session.h"

namespace emtb {

/// A session in an HDF5 file, open: everything but the readings, and where those are. Private to session/.
struct StoredSession {
  struct StoredSignal {
    Signal signal{};
    h5::Column t;
    h5::Column value;
    hsize_t rows = 0;  ///< the shorter of the two: a writer may die between them
    hsize_t lost = 0;  ///< rows behind these that the file was cut off before
    double window = 0;
    double lsb = 0;
    std::string source;
  };

  std::filesystem::path path;
  h5::Opened opened;
  std::vector<StoredSignal> signals;
  std::vector<Event> events;
  std::map<std::string, std::string> attributes;  ///< of the root, but for format and complete
  std::string config;
  bool complete = true;

  /// Whether the file is as its writer meant to leave it.
  bool intact() const;

  [[noreturn]] void fail(const std::string& object, const std::string& what) const;

  /// The rows of one of an object's datasets. @throws SessionError that names the object
  std::vector<double> numbers(const std::string& object, const h5::Column& column, hsize_t first, hsize_t count) const;
};

/// @throws SessionError where the file cannot be opened or is not a session
StoredSession open_stored(const std::filesystem::path& path);

}  // namespace emtb
