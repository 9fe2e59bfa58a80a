#include "server/unix_socket.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstring>
#include <thread>

#include "tests/process.h"
#include "tests/raw_client.h"
#include "tests/session/scratch.h"

namespace emtb {
namespace {

using testing::HasSubstr;

using Raw = RawClient;

class UnixSocketTest : public Scratch {
 protected:
  void start() {
    server = std::make_unique<UnixSocketServer>(path("s"));
    server->start({.line = [this](std::string_view line, const rpc::Peer& peer) -> rpc::Reply {
                     if (line == "count") ++counted;
                     if (line == "wait") {
                       rpc::Reply reply;
                       reply.later = [this] { return std::string(waits ? "" : "waited"); };
                       return reply;
                     }
                     if (line == "subscribe") server->subscribe(peer.id, 0.01);
                     if (line == "clients") return std::to_string(server->clients().size());
                     if (line == "who") return std::to_string(peer.pid) + " " + std::to_string(peer.uid);
                     if (line == "flood") return std::string(100'000, 'x');
                     return "<" + std::string(line) + ">";
                   },
                   .gone = [this](const rpc::Peer&) { ++gone; },
                   .live = [](std::uint64_t) { return std::string("live"); },
                   .stop = {.stop = [this] { return ++stops; },
                            .stopped = [](std::uint64_t) { return Stopped{.run = 0, .safe = true}; }}});
  }
  std::unique_ptr<UnixSocketServer> server;
  std::atomic<int> gone{0}, counted{0};
  std::atomic<bool> waits{true};
  std::atomic<std::uint64_t> stops{0};
};

TEST_F(UnixSocketTest, AnswersLineByLineHoweverTheyArrive) {
  start();
  Raw client(path("s"));
  client.send("a\nb\nc");
  EXPECT_EQ(client.line(), "<a>");
  EXPECT_EQ(client.line(), "<b>");
  client.send("d\r\n\n");
  EXPECT_EQ(client.line(), "<cd>");
  client.send("who\n");
  EXPECT_EQ(client.line(), std::to_string(getpid()) + " " + std::to_string(getuid()));
}

TEST_F(UnixSocketTest, IsForOwnerAndGroupOnly) {
  start();
  struct stat info {};
  ASSERT_EQ(stat(path("s").c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777, 0660u);
}

TEST_F(UnixSocketTest, ServesManyClientsAndNoticesEachThatGoes) {
  start();
  {
    std::vector<std::unique_ptr<Raw>> clients;
    for (int i = 0; i < 20; ++i) clients.push_back(std::make_unique<Raw>(path("s")));
    for (auto& client : clients) client->send("x\n");
    for (auto& client : clients) EXPECT_EQ(client->line(), "<x>");
    clients[0]->send("clients\n");
    EXPECT_EQ(clients[0]->line(), "20");
  }
  EXPECT_TRUE(eventually([&] { return gone == 20; }));
}

TEST_F(UnixSocketTest, RefusesMoreClientsThanItCanServe) {
  start();
  std::vector<std::unique_ptr<Raw>> clients;
  for (std::size_t i = 0; i < UnixSocketServer::most_clients; ++i) {
    clients.push_back(std::make_unique<Raw>(path("s")));
    clients.back()->send("x\n");
    EXPECT_EQ(clients.back()->line(), "<x>");
  }
  Raw one_more(path("s"));
  EXPECT_EQ(one_more.line(), "");
  EXPECT_TRUE(one_more.ended);
}

TEST_F(UnixSocketTest, ThoseWhoNeverAskKeepNobodyOut) {
  start();
  std::vector<std::unique_ptr<Raw>> silent;
  for (int i = 0; i < 200; ++i) silent.push_back(std::make_unique<Raw>(path("s")));
  Raw one_more(path("s"));
  one_more.send("x\n");
  EXPECT_EQ(one_more.line(), "<x>") << "whoever wants to stop a run must get in";
}

TEST_F(UnixSocketTest, AnswersAFloodAtItsRateAndOthersAtOnce) {
  start();
  Raw flood(path("s"));
  Raw other(path("s"));
  constexpr int requests = 2000;  // a second's worth saved up, and a second's worth to wait for
  const auto begin = std::chrono::steady_clock::now();
  std::thread sender([&] {
    for (int i = 0; i < requests; ++i) flood.send("x\n");
  });
  for (int i = 0; i < requests; ++i) ASSERT_EQ(flood.line(), "<x>");
  sender.join();
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  EXPECT_GT(took.count(), requests / UnixSocketServer::most_requests - 1.1);
  other.send("y\n");
  EXPECT_EQ(other.line(), "<y>");
}

TEST_F(UnixSocketTest, EndsAClientWhoseLineIsTooLong) {
  start();
  Raw client(path("s"));
  client.send(std::string(UnixSocketServer::longest_line - 1, 'x') + "\n");
  EXPECT_EQ(client.line().size(), UnixSocketServer::longest_line + 1);
  client.send(std::string(UnixSocketServer::longest_line + 10, 'x'));
  EXPECT_THAT(client.line(), HasSubstr("-32600"));
  EXPECT_EQ(client.line(), "");
  EXPECT_TRUE(client.ended);
  EXPECT_TRUE(eventually([&] { return gone == 1; }));
}

TEST_F(UnixSocketTest, DropsAClientThatDoesNotReadAndServesTheOthers) {
  start();
  Raw lazy(path("s"));
  Raw other(path("s"));
  for (int i = 0; i < 100 && gone == 0; ++i) lazy.send("flood\n");
  EXPECT_TRUE(eventually([&] { return gone == 1; }));
  other.send("x\n");
  EXPECT_EQ(other.line(), "<x>");
}

TEST_F(UnixSocketTest, SendsLiveLinesAndPublishedOnesToSubscribersOnly) {
  start();
  Raw subscriber(path("s"));
  Raw other(path("s"));
  other.send("x\n");
  EXPECT_EQ(other.line(), "<x>");
  subscriber.send("subscribe\n");
  EXPECT_EQ(subscriber.line(), "<subscribe>");
  EXPECT_EQ(subscriber.line(), "live");
  server->publish("news");
  EXPECT_TRUE(eventually([&] { return subscriber.line() == "news"; }));
  EXPECT_EQ(other.line(0.1), "");
}

TEST_F(UnixSocketTest, SubscribingTwiceChangesTheRateAndNothingElse) {
  start();
  Raw client(path("s"));
  client.send("subscribe\nsubscribe\nsubscribe\n");
  int live = 0;
  for (int i = 0; i < 3; ++i) client.line();
  const auto start_time = std::chrono::steady_clock::now();
  while (live < 50) live += client.line() == "live";
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start_time;
  EXPECT_GT(took.count(), 0.4) << "one timer of 10 ms, not three";
}

TEST_F(UnixSocketTest, TakesTheSocketOfADeadDaemonButNotOfALivingOne) {
  start();
  EXPECT_THAT(message_of<ProtocolError>([&] { UnixSocketServer second(path("s")); }),
              HasSubstr("another daemon answers"));
  server.reset();
  EXPECT_FALSE(std::filesystem::exists(path("s"))) << "an orderly end leaves nothing behind";

  const int dead =
      ::socket(AF_UNIX, SOCK_STREAM, 0);  // bound, then closed without unlink, as a killed daemon leaves it
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path("s").c_str(), sizeof address.sun_path - 1);
  ASSERT_EQ(bind(dead, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  close(dead);
  ASSERT_TRUE(std::filesystem::exists(path("s")));
  start();
  Raw client(path("s"));
  client.send("x\n");
  EXPECT_EQ(client.line(), "<x>");
}

TEST_F(UnixSocketTest, SeesTheEndOfAClientWhateverItSentBefore) {
  start();
  {
    Raw client(path("s"));
    client.send("x\n");
    EXPECT_EQ(client.line(), "<x>");
    client.send_what_fits(std::string(200'000, '\n'));  // minutes of lines, at the rate that is answered
  }
  EXPECT_TRUE(eventually([&] { return gone == 1; }, 10));
}

TEST_F(UnixSocketTest, WhatWasAskedWithTheLastBreathCounts) {
  start();
  { Raw(path("s")).send("count\ncount\n"); }
  EXPECT_TRUE(eventually([&] { return gone == 1; }));
  EXPECT_EQ(counted, 2);
}

TEST_F(UnixSocketTest, AnAnswerThatTakesItsTimeKeepsOnlyItsOwnClientWaiting) {
  start();
  Raw patient(path("s"));
  Raw other(path("s"));
  patient.send("wait\nx\n");
  other.send("y\n");
  EXPECT_EQ(other.line(), "<y>");
  waits = false;
  EXPECT_EQ(patient.line(), "waited");
  EXPECT_EQ(patient.line(), "<x>") << "in the order of the questions";
}

TEST_F(UnixSocketTest, LeavesTheSocketOfAnotherAtItsPathAlone) {
  start();
  std::filesystem::remove(path("s"));
  std::filesystem::remove(path("s.stop"));
  auto first = std::move(server);
  start();
  first.reset();
  EXPECT_TRUE(std::filesystem::exists(path("s")));
  EXPECT_TRUE(std::filesystem::exists(path("s.stop")));
  Raw client(path("s"));
  client.send("x\n");
  EXPECT_EQ(client.line(), "<x>");
}

TEST_F(UnixSocketTest, EveryCallerOfTheStopIsAnsweredOnceItIsObeyed) {
  start();
  std::vector<std::unique_ptr<Raw>> callers;
  for (int i = 0; i < 100; ++i) callers.push_back(std::make_unique<Raw>(path("s.stop")));
  for (auto& caller : callers) EXPECT_EQ(caller->line(), R"({"stopped": null, "reference_safe": true})");
  EXPECT_GE(stops, 1u);
  struct stat info {};
  ASSERT_EQ(stat(path("s.stop").c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777, 0660u);
}

TEST_F(UnixSocketTest, DoesNotReplaceWhatIsNoSocket) {
  write("s", "somebody's file");
  EXPECT_THROW(start(), ProtocolError);
  EXPECT_EQ(read(path("s")), "somebody's file");
  EXPECT_THROW(UnixSocketServer(path("no/such/folder/s")), ProtocolError);
  EXPECT_THROW(UnixSocketServer("/tmp/" + std::string(200, 'x')), ProtocolError);
}

}  // namespace
}  // namespace emtb
