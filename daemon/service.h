#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "config/bench.h"
#include "daemon/admission.h"
#include "daemon/device_clock.h"
#include "daemon/estimator.h"
#include "daemon/loop.h"
#include "daemon/realtime.h"
#include "daemon/recorder.h"
#include "daemon/trace.h"
#include "server/rpc.h"

namespace emtb {

/// What clients may ask of the daemon: the methods of the socket, and the experiment that is on.
///
/// Methods run on the server's thread; closed() on the recorder's. Nothing here is waited for by the loop.
class Service {
 public:
  struct Settings {
    std::filesystem::path data;             ///< where sessions go
    std::vector<Channel> channels;          ///< what the bench measures
    std::string pace;                       ///< `1`, `20`, `max`
    std::function<std::uint64_t()> room{};  ///< [bytes] left for sessions; empty: not asked
    std::function<std::vector<DeviceClock>()> clocks{};
    std::optional<Profile> recorded{};  ///< of a replay: the one profile that there is to run
    std::string replay_of{};            ///< the session that is replayed
  };

  /// What the service wants of the socket. Both only from within a method.
  struct Socket {
    std::function<void(std::uint64_t peer, double period)> subscribe;
    std::function<void(std::uint64_t peer, double period)> stream;  ///< blocks of samples
    std::function<std::vector<rpc::Peer>()> clients;
    std::function<void(std::string line)> publish;  ///< from any thread
  };

  Service(const BenchConfig& bench, Settings settings, Mailbox& mailbox, Live& live, Recorder& recorder,
          Estimator& estimator, Trace& trace);
  ~Service();

  void connect(Socket socket) { socket_ = std::move(socket); }
  void set_realtime(std::vector<RealtimeStep> steps) { realtime_ = std::move(steps); }

  rpc::Reply answer(std::string_view line, const rpc::Peer& peer) const { return methods_.answer(line, peer); }

  /// The line that this subscriber is sent at its rate: `live`, with the estimates where it asked for them.
  std::string live_line(std::uint64_t peer) const;

  /// A client's connection ended: its run ends with it.
  void gone(const rpc::Peer& peer);

  /// A run's file is closed: subscribers are told with `ended`.
  void closed(const Closed& closed);

  /// How punctual the loop was since the run began, for its session; empty in simulated time, which knows no lateness.
  std::string figures() const;

  /// Where a black box was written.
  void dumped(const std::filesystem::path& path);

  /// Whether a run is on or its file still open.
  bool busy() const;

 private:
  struct Current {
    std::unique_ptr<const Order> order;
    std::filesystem::path path;
    rpc::Peer controller;
    Durations late{}, work{};  ///< before it
    std::uint64_t missed = 0;
  };

  nlohmann::json status(const rpc::Peer& peer) const;
  nlohmann::json run(const rpc::Params& params, const rpc::Peer& peer);
  nlohmann::json stop();
  nlohmann::json confirm(const rpc::Peer& peer);
  rpc::Later reset(const rpc::Peer& peer);
  nlohmann::json subscribe(const rpc::Params& params, const rpc::Peer& peer);
  rpc::Later estimates(const rpc::Params& params);
  nlohmann::json samples(const rpc::Params& params, const rpc::Peer& peer);
  nlohmann::json history(const rpc::Params& params) const;
  nlohmann::json config() const;

  SessionWriter::Description session_of(const Order& order, const rpc::Params& params, const rpc::Peer& peer,
                                        double now) const;
  std::unique_ptr<nlohmann::json> ended(const Closed& closed) const;
  nlohmann::json pause() const;
  nlohmann::json fault() const;
  nlohmann::json signals() const;
  nlohmann::json clocks() const;
  void refuse_if_busy(const std::string& what, const rpc::Peer& peer) const;

  const BenchConfig& bench_;
  const Settings settings_;
  Mailbox& mailbox_;
  Live& live_;
  Recorder& recorder_;
  Estimator& estimator_;
  Trace& trace_;
  Admission admission_;
  Socket socket_;
  std::vector<RealtimeStep> realtime_;
  rpc::Methods methods_;

  mutable std::mutex mutex_;
  std::set<std::uint64_t> want_estimates_;  ///< subscribers
  std::optional<Current> current_;
  std::unique_ptr<nlohmann::json> last_;  // how the run before ended; null: none yet
  std::filesystem::path black_box_;       // the last one; empty: none yet
  std::uint64_t next_run_ = 1;
};

}  // namespace emtb
