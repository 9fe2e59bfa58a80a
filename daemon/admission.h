#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "config/bench.h"
#include "config/profile.h"
#include "daemon/loop.h"

namespace emtb {

/// Which experiment is meant, and whether it may run on this bench now.
class Admission {
 public:
  struct Settings {
    std::filesystem::path data;             ///< where sessions go
    std::vector<Channel> channels;          ///< what the bench measures
    std::function<std::uint64_t()> room{};  ///< [bytes] left for sessions; empty: not asked
    std::optional<Profile> recorded{};      ///< of a replay: the one profile that there is to run
    std::string replay_of{};                ///< the session that is replayed
  };

  /// @param bench, live outlive it
  Admission(const BenchConfig& bench, const Live& live, Settings settings);

  /// The motor stands from now on: what `needs: {idle: ...}` counts. From any thread.
  void run_ended();

  /// @param text a profile's name, never a path, or its YAML
  /// @throws rpc::Refusal where there is no such experiment, or it goes beyond the bench's limits
  Experiment find(const std::string& text) const;

  /// @throws rpc::Refusal where what the experiment needs is not there: a motor at rest or cold, a field, room on the
  /// disk
  void refuse_unless_ready(const Experiment& experiment) const;

 private:
  Experiment read(const std::string& text) const;
  void refuse_beyond_limits(const Experiment& experiment) const;
  void need_rest(const Experiment& experiment) const;
  void need_field(const Experiment& experiment) const;
  void need_temperature(const Experiment& experiment, double highest) const;
  void need_idle(const Experiment& experiment, double minutes) const;
  void need_memory() const;
  void need_room(const Experiment& experiment) const;
  double reading(Signal signal) const;

  const BenchConfig& bench_;
  const Live& live_;
  Settings settings_;
  // [min] since the last run: those before `idle_since_`, and those by a clock that nobody sets since then.
  std::atomic<double> idle_before_, idle_since_;
};

}  // namespace emtb
