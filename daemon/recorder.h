#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "daemon/black_box.h"
#include "daemon/ring.h"
#include "session/writer.h"

namespace emtb {

/// Where a recording goes: SessionWriter, or in tests a disk that refuses. Every call may throw SessionError.
class SessionSink {
 public:
  virtual ~SessionSink() = default;
  virtual void append(Signal signal, std::span<const double> t, std::span<const double> value) = 0;
  virtual void append(const Event& event) = 0;
  virtual void flush() = 0;
  virtual void finish() = 0;
};

using OpenSink =
    std::function<std::unique_ptr<SessionSink>(const std::filesystem::path&, const SessionWriter::Description&)>;

/// Writes HDF5 by SessionWriter.
std::unique_ptr<SessionSink> open_session(const std::filesystem::path& path,
                                          const SessionWriter::Description& description);

/// How a run ended, once its file is closed.
struct Closed {
  std::filesystem::path path;
  Outcome outcome = Outcome::done;
  Fault fault = Fault::none;
  std::string text;  ///< of the fault with what showed it; empty otherwise
  double t = 0;      ///< [s] length of the run
  bool complete = true;
};

/// What a fault record says, with signal and value: `over_speed: ... (omega = 210.3 rad/s)`.
std::string describe(Fault fault, std::optional<Signal> signal, double value);

/// What an event record says: of a fault or of a gap.
std::string describe(const Record& record);

/// `2011-04-01T12:00:00.000Z`. @param utc [s] since 1970
std::string utc_text(double utc);

/// Below this a session that is on is ended while it still can be ended well.
inline constexpr std::uint64_t disk_reserve = 64 * 1024 * 1024;  // [bytes]

/// What the folder's disk has room for [bytes]; all where nobody can tell.
std::uint64_t free_space(const std::filesystem::path& folder);

/// Empties the loop's ring into a session, one file a run; what work() has written survives the process after 100 ms.
///
/// open() from any thread, work() from the recorder's; both may wait for the disk.
class Recorder {
 public:
  struct Listeners {
    std::function<void(const Closed&)> closed{};              ///< after each run; on work()'s thread
    std::function<void(const std::string& text)> happened{};  ///< faults and gaps, for the log
    std::function<std::string()> figures{};  ///< how punctual the loop was in the run that ends; empty: not known
    std::function<std::vector<std::string>()> clocks{};  ///< how the devices' clocks ran until now, one text each
    std::function<void(const std::filesystem::path&)> dumped{};  ///< where a black box was written
    /// What others have for the session of a run, the runs counted from 0 on; must not wait.
    std::function<std::vector<Event>(std::uint32_t run)> remarks{};
  };

  /// What surrounds the recordings.
  struct Surroundings {
    std::atomic<bool>* disk_low = nullptr;  ///< set while a session is recorded and room() is below disk_reserve
    std::function<std::uint64_t()> room{};  ///< [bytes] left for sessions
    std::optional<BlackBox> black_box{};
  };

  /// @param failed set while the session cannot be written: the loop looks at it
  Recorder(Ring& ring, std::atomic<bool>& failed, OpenSink open, Listeners listeners, Surroundings surroundings);
  Recorder(Ring& ring, std::atomic<bool>& failed, OpenSink open, Listeners listeners);

  /// Writes the black box that is due, if one is; for the end of the process.
  void finish();

  /// Begins a session. @throws SessionError where the file cannot be created.
  void open(const std::filesystem::path& path, const SessionWriter::Description& description,
            const std::string& profile);

  /// Moves what the ring holds, flushes when due. @param now [s] wall time. @return how many records there were
  std::size_t work(double now);

  bool recording() const;

  /// Work failed for a reason that is not the file's (no memory): the session that is on cannot be gone on with.
  void give_up(const std::string& why);

 private:
  struct Batch {
    std::vector<double> t;
    std::vector<double> value;
  };

  void take(const Record& record);
  void take_remarks();
  void close(const Record& end);
  void write_batches();
  void attempt(const std::function<void()>& write);
  void look_at_disk(double now);
  void dump();

  Ring& ring_;
  std::atomic<bool>& failed_;
  const OpenSink open_;
  const Listeners listeners_;
  Surroundings surroundings_;

  mutable std::mutex mutex_;  // between open() and work()
  std::unique_ptr<SessionSink> sink_;
  std::filesystem::path path_;
  std::uint32_t runs_ = 0;  // that have ended
  bool open_run_ = false;   // also where the sink failed, until the end record
  std::string problem_;     // why the sink failed
  std::string fault_text_;
  double flushed_ = 0;          // [s]
  double disk_seen_ = 0;        // [s]
  std::string latched_by_;      // why a black box is due; empty: none is
  double dump_at_ = 0;          // [s]
  double now_ = 0;              // [s]
  std::vector<Closed> closed_;  // not yet told
  std::map<Signal, Batch> batches_;
};

/// What a session holds of a bench: its channels, and the commanded reference in the place of one that is read back. A
/// read-back is a step of the converter off and a tick late; what drives the model is the command.
/// @param rate [Hz] of the loop
std::vector<Channel> recorded_channels(std::vector<Channel> channels, double rate);

/// A free file name: `DATA/<utc yyyymmddThhmmssZ>-<profile>.h5`, with -2, -3 ... where taken.
/// @param utc seconds since 1970
std::filesystem::path session_path(const std::filesystem::path& data, std::int64_t utc, const std::string& profile);

}  // namespace emtb
