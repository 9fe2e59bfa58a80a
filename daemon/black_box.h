#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "daemon/ring.h"
#include "hal/input_device.h"

namespace emtb {

/// The last seconds of all signals, events and states of the loop, in a run or not, for whoever asks afterwards what
/// happened.
///
/// Of the recorder's thread. All memory is taken at the start.
class BlackBox {
 public:
  static constexpr double seconds = 10;  // [s] kept

  struct Settings {
    std::filesystem::path folder{};                   ///< of the sessions
    std::vector<Channel> channels{};                  ///< with u_ref
    double period = 1e-3;                             ///< [s] of the loop: of channels that are read at every tick
    std::map<std::string, std::string> attributes{};  ///< bench, software
    std::string config{};                             ///< the bench file, whole
  };

  explicit BlackBox(Settings settings);

  void take(const Record& record);

  /// Writes what is kept as a session, `FOLDER/<utc>-blackbox.h5`. @param why the fault, as its note
  /// @param utc seconds since 1970
  /// @return where it is; empty where nothing has been measured yet
  /// @throws SessionError where it cannot be written.
  std::filesystem::path dump(std::int64_t utc, const std::string& why) const;

 private:
  struct Point {
    double at = 0;  // [s] on the loop's clock
    double value = 0;
  };
  struct Track {  // a circle
    std::vector<Point> points;
    std::size_t written = 0;
  };

  Settings settings_;
  std::map<Signal, Track> tracks_;
  std::vector<Record> happened_;  // a circle, too
  std::size_t happenings_ = 0;
};

}  // namespace emtb
