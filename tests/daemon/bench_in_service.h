#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "daemon/daemon.h"
#include "server/client.h"
#include "tests/emtbd.h"
#include "tests/faulty_device.h"
#include "tests/process.h"
#include "tests/session/scratch.h"

namespace emtb {

/// Fake time that a thread can live in: sleeps take a little real time, so that nothing spins.
class HastyClock final : public Clock {
 public:
  double now() const noexcept override { return now_; }
  void sleep_until(double t) noexcept override {
    if (idle) std::this_thread::sleep_for(std::chrono::microseconds(200));
    if (t > now_) now_ = t;
  }
  std::atomic<bool> idle{true};

 private:
  std::atomic<double> now_{5};
};

/// The whole daemon in this process, with fake devices and a real socket.
class BenchInService : public Scratch {
 protected:
  static constexpr const char* bench =
      "name: fake\n"
      "rate: 1000\n"
      "reference: {device: card, min: 0, max: 6, safe: 0}\n"
      "limits: {omega: 190, time: 1000000}\n"
      "devices: {card: {driver: fake}}\n";
  static constexpr const char* level = "name: level\nkind: step\nlevel: 3\nbefore: 0.1\nhold: 0.5\nafter: 0.1\n";
  static constexpr const char* endless = "name: endless\nkind: step\nlevel: 3\nbefore: 0.1\nhold: 50000\nafter: 0.1\n";

  /// A disk that lets nobody go on while it is busy.
  class SlowSink final : public SessionSink {
   public:
    SlowSink(BenchInService& test, std::unique_ptr<SessionSink> file) : test_(test), file_(std::move(file)) {}
    void append(Signal signal, std::span<const double> t, std::span<const double> value) override {
      file_->append(signal, t, value);
    }
    void append(const Event& event) override { file_->append(event); }
    void flush() override {
      while (test_.disk_busy) {
        test_.flush_waits = true;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
      file_->flush();
    }
    void finish() override { file_->finish(); }

   private:
    BenchInService& test_;
    std::unique_ptr<SessionSink> file_;
  };

  void start() {
    auto input = std::make_unique<FaultyInput>(clock, std::vector<Channel>{{.signal = Signal::omega,
                                                                            .period = card_period,
                                                                            .window = 0,
                                                                            .lsb = 0.1,
                                                                            .source = "card 0",
                                                                            .low = -200,
                                                                            .high = 200}});
    auto reference = std::make_unique<FaultyOutput>(config_.reference.limits);
    card = input.get();
    output = reference.get();
    Bench devices;
    devices.clock = clock;
    devices.inputs.push_back(std::move(input));
    devices.reference = std::move(reference);
    server_ = std::make_unique<UnixSocketServer>(path("sock"));
    daemon_ = std::make_unique<Daemon>(config_, std::move(devices), *server_,
                                       Daemon::Settings{.data = path(""),
                                                        .pace = "max",
                                                        .set_pace = [this](bool busy) { clock->idle = !busy || slow; },
                                                        .realtime = Realtime::off,
                                                        .log = [](const std::string&) {},
                                                        .open_sink =
                                                            [this](const auto& file, const auto& description) {
                                                              return std::make_unique<SlowSink>(
                                                                  *this, open_session(file, description));
                                                            },
                                                        .room = [this] { return room.load(); },
                                                        .at_work = at_work});
  }

  static int refusal(Client& client, const std::string& method,
                     const nlohmann::json& params = nlohmann::json::object()) {
    try {
      client.call(method, params);
    } catch (const rpc::Refusal& e) {
      return e.code();
    }
    return 0;
  }

  std::shared_ptr<HastyClock> clock = std::make_shared<HastyClock>();
  double card_period = 1e-3;                    // [s]
  bool slow = false;                            // runs take their time too
  std::atomic<std::uint64_t> room{1ull << 40};  // [bytes] on the disk
  std::function<void()> at_work;
  std::atomic<bool> disk_busy{false}, flush_waits{false};
  FaultyInput* card = nullptr;
  FaultyOutput* output = nullptr;
  const BenchConfig config_ = read_bench(write("bench.yaml", bench));
  std::unique_ptr<UnixSocketServer> server_;
  std::unique_ptr<Daemon> daemon_;
};

}  // namespace emtb
