#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "config/bench.h"
#include "daemon/estimator.h"
#include "daemon/loop.h"
#include "daemon/loop_thread.h"
#include "daemon/recorder.h"
#include "daemon/service.h"
#include "daemon/trace.h"
#include "hal/bench.h"
#include "server/unix_socket.h"

namespace emtb {

/// A bench in service: loop, recorder and socket with their threads. Whatever way it ends, the reference is safe then.
class Daemon {
 public:
  struct Settings {
    std::filesystem::path data;
    std::string pace = "1";                     ///< as clients are told
    std::function<void(bool busy)> set_pace{};  ///< simulated time; empty: real time
    Realtime realtime = Realtime::off;
    std::optional<Profile> recorded{};  ///< of a replay: the one profile that there is to run
    std::string replay_of{};            ///< the session that is replayed; kept in the new one
    std::function<void(const std::string&)> log;
    OpenSink open_sink = open_session;
    std::function<std::uint64_t()> room{};  ///< [bytes] left for sessions; empty: free_space(data)
    std::function<void()> at_work{};        ///< told once the loop ticks, before anybody is let in who could arm it
  };

  /// Starts everything. @param server already holds its path
  /// @throws Error where real time is required and cannot be had, or the bench does not fit.
  Daemon(const BenchConfig& config, Bench bench, UnixSocketServer& server, Settings settings);
  ~Daemon();
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;

  /// Ends a run with the fault `terminated` and waits until its session is closed.
  void terminate();

  /// The guardian is gone: latches. @param replaced there is a new one already
  void guardian_lost(bool replaced) noexcept;

  /// Counts on as long as the loop lives; for the watchdog.
  std::uint64_t ticks() const noexcept { return live_.ticks.load(); }

 private:
  struct GuardedBench : Bench {  // safe even where the constructor throws
    ~GuardedBench() { reference->make_safe(); }
  };

  Recorder::Listeners listeners_of_recorder();
  Recorder::Surroundings surroundings_of_recorder();
  Service::Settings service_settings() const;
  Loop::Settings loop_settings() const;
  void follow_named_model();
  void begin();
  void end();
  std::optional<Stopped> stopped(std::uint64_t number) const noexcept;
  void record();
  void keep_trace();

  const BenchConfig& config_;
  GuardedBench bench_;
  UnixSocketServer& server_;
  const std::vector<Channel> channels_;  // of all devices
  Settings settings_;
  Mailbox mailbox_;
  Live live_;
  Ring ring_;
  Trace trace_;
  Estimator estimator_;
  Recorder recorder_;
  Service service_;
  Loop loop_;
  std::unique_ptr<LoopThread> loop_thread_;
  std::atomic<bool> quit_{false};
  std::thread recorder_thread_, trace_thread_;
};

}  // namespace emtb
