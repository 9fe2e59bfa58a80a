#include "server/client.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>

#include "hal/error.h"
#include "server/unix_socket.h"
#include "tests/session/scratch.h"

namespace emtb {
namespace {

using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;

/// Beside a daemon that speaks a protocol of our choice.
class ClientOfADaemon : public Scratch {
 protected:
  void serve(const json& status) {
    server_ = std::make_unique<UnixSocketServer>(path("s"));
    server_->start({.line = [this, status](std::string_view line, const rpc::Peer&) -> rpc::Reply {
                      const json request = json::parse(line);
                      asked.push_back(request["method"]);
                      const json result = request["method"] == "status" ? status : json::object();
                      return json{{"jsonrpc", "2.0"}, {"id", request["id"]}, {"result", result}}.dump();
                    },
                    .gone = [](const rpc::Peer&) {},
                    .live = [](std::uint64_t) { return std::string(); }});
  }
  std::vector<std::string> asked;  // looked at only between an answer and the next question

 private:
  std::unique_ptr<UnixSocketServer> server_;
};

TEST_F(ClientOfADaemon, AsksForTheProtocolOnceBeforeAnythingMoves) {
  serve({{"protocol", 1}});
  Client client(path("s"));
  client.call("reset", json::object());
  client.call("run", json::object());
  EXPECT_THAT(asked, ElementsAre("status", "reset", "run"));
}

TEST_F(ClientOfADaemon, WaitsAMomentForADaemonThatHasJustBeenStarted) {
  std::jthread later([this] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    serve({{"protocol", 1}});
  });
  EXPECT_EQ(daemon_at(path("s")).call("status", json::object())["protocol"], 1);
}

TEST_F(ClientOfADaemon, SaysThatNobodyAnswersAfterASecond) {
  EXPECT_THAT(message_of<ProtocolError>([&] { daemon_at(path("s")); }), HasSubstr("no daemon answers"));
}

TEST_F(ClientOfADaemon, MovesNothingWhereTheDaemonIsNewer) {
  serve({{"protocol", 2}});
  Client client(path("s"));
  for (const char* method : {"run", "reset", "status"}) {
    EXPECT_THAT(message_of<ProtocolError>([&] { client.call(method, json::object()); }),
                HasSubstr("made by a newer emtb: it is `emtb protocol 2`"));
  }
  EXPECT_THAT(asked, ElementsAre("status", "status", "status"));
}

TEST_F(ClientOfADaemon, LooksAndStopsWhateverTheProtocol) {
  serve({{"protocol", 2}});
  Client client(path("s"));
  client.call("subscribe", json::object());
  client.call("stop", json::object());
  EXPECT_THAT(asked, ElementsAre("subscribe", "stop"));
}

}  // namespace
}  // namespace emtb
