#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>

#include "hal/input_device.h"
#include "session/session.h"

namespace emtb {

/// Writes a session while it is being recorded, so that whatever is flushed survives the death of the process.
///
/// HDF5 in SWMR mode (docs/decisions): all objects are created up front, rows are appended, flush() makes them durable.
/// Not thread-safe; not for the loop's thread (a flush was seen to take 100 ms).
class SessionWriter {
 public:
  struct Description {
    std::vector<Channel> channels;
    std::map<std::string, std::string> attributes;  ///< profile, bench, operator, note, software, started_utc
    std::string config;                             ///< the bench YAML, whole
  };

  /// @throws SessionError where the file exists or cannot be created.
  SessionWriter(const std::filesystem::path& path, const Description& description);
  ~SessionWriter();  ///< writes what was appended and closes as incomplete, unless finish() was called
  SessionWriter(SessionWriter&&) noexcept;
  SessionWriter& operator=(SessionWriter&&) noexcept;

  /// Appends rows to a signal. A row that is not finite, or not later than the one before, is no reading and is left
  /// out.
  /// @throws SessionError where the disk refuses; nothing more can be written then, and what was flushed before is
  /// kept.
  void append(Signal signal, std::span<const double> t, std::span<const double> value);
  void append(const Event& event);  ///< a text beyond 240 bytes is cut

  /// Everything appended so far survives kill -9 from here on. @throws SessionError
  void flush();

  /// Marks the session complete and closes it. @throws SessionError
  void finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Whether a process that lives has the session open for recording.
bool is_being_recorded(const std::filesystem::path& path);

/// Whether a file looks as if the writer of a session had died: repair_session() may have something to do. Reads a few
/// bytes only, and trusts nothing that they say.
bool ended_abruptly(const std::filesystem::path& path);

/// What the process does that is there for one repair alone (a damaged file may be the end of it): bounds its time and
/// memory, then repair_session().
bool repair_alone(const std::filesystem::path& path);

/// Makes a session whose writer died readable again; marks it incomplete and notes the repair as an event.
/// @return true where there was something to repair.
/// The file is replaced by a copy of all that can be read; it stands as it was until the copy is whole
/// (docs/decisions). Where rows were lost to more than the death of the writer, it is kept as PATH.damaged.
/// @throws SessionError where the file is not a session, is being recorded, or cannot be saved.
bool repair_session(const std::filesystem::path& path);

}  // namespace emtb
