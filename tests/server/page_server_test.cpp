#include "server/page_server.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "server/page_checks.h"
#include "server/rpc.h"
#include "server/unix_socket.h"
#include "tests/process.h"
#include "tests/server/page_browser.h"
#include "tests/session/scratch.h"

namespace emtb {
namespace {

using nlohmann::json;
using testing::HasSubstr;

TEST(PageChecks, AnswersToThisComputerByItsOwnNamesAlone) {
  for (const char* host : {"localhost", "localhost:8088", "LOCALHOST:9000", "127.0.0.1:1", "[::1]", "[::1]:8088"}) {
    EXPECT_TRUE(host_allowed(host, "")) << host;
  }
  for (const char* host : {"", "evil.com", "localhost.evil.com", "localhost:", "localhost:80x", "localhost:8088:1",
                           "127.0.0.1.evil.com", "[::1", "[::1]evil", "192.168.0.7", "localhost@evil.com"}) {
    EXPECT_FALSE(host_allowed(host, "")) << host;
  }
  EXPECT_TRUE(host_allowed("192.168.0.7:8088", "192.168.0.7"));
  EXPECT_TRUE(host_allowed("[fe80::1]:8088", "fe80::1"));
  EXPECT_FALSE(host_allowed("192.168.0.8:8088", "192.168.0.7"));
}

TEST(PageChecks, AnOriginIsOursWhereItIsTheHost) {
  EXPECT_TRUE(origin_matches("http://localhost:8088", "localhost:8088"));
  EXPECT_TRUE(origin_matches("http://localhost:9000", "localhost:9000")) << "through ssh -L";
  for (const char* origin : {"", "null", "http://localhost", "http://localhost:8088.evil.com", "http://evil.com",
                             "file://localhost:8088", "http://localhost:9000"}) {
    EXPECT_FALSE(origin_matches(origin, "localhost:8088")) << origin;
  }
}

TEST(PageChecks, ATokenIsWholeAndNeverTheSame) {
  const std::string token = random_token();
  EXPECT_EQ(token.size(), 32u);
  EXPECT_NE(token, random_token());
  EXPECT_TRUE(same_token(token, token));
  EXPECT_FALSE(same_token(token.substr(1), token));
  EXPECT_FALSE(same_token("", ""));
}

/// A page's server over what looks like a daemon.
class PageOfBench : public Scratch {
 protected:
  PageOfBench() : daemon_(std::make_unique<UnixSocketServer>(path("s"))) {
    serve_daemon();
    server_.emplace(PageServer::Settings{.port = 0,
                                         .listen = "127.0.0.2",
                                         .token = token,
                                         .version = "1",
                                         .socket = path("s"),
                                         .files = false,
                                         .imports = path("imports"),
                                         .worker = {},
                                         .methods = {},
                                         .file = [](std::string_view name) -> std::optional<PageFile> {
                                           if (name != "/") return {};
                                           return PageFile{"<!doctype html>", "text/html"};
                                         }});
    thread_ = std::thread([this] { server_->run(); });
  }
  ~PageOfBench() override {
    server_->stop();
    thread_.join();
    server_.reset();
    daemon_.reset();
  }

  void serve_daemon() {
    daemon_->start({.line = [this](std::string_view line, const rpc::Peer& peer) { return answer(line, peer); },
                    .gone = [this](const rpc::Peer&) { ++gone_; },
                    .live = [](std::uint64_t) { return std::string(); },
                    .stop = {.stop = [this] { return std::uint64_t(++stops_); },
                             .stopped = [](std::uint64_t) { return std::optional(Stopped{.run = 7, .safe = true}); }}});
  }

  rpc::Reply answer(std::string_view line, const rpc::Peer& peer) {
    const json request = json::parse(line);
    if (request["method"] == "never") return {};
    if (request["method"] == "flood") {
      flood_ = peer.id;
      return rpc::answer_result(request["id"], std::string(60000, 'x'));
    }
    return rpc::answer_result(request["id"], {{"asked", request["method"]}, {"peer", peer.id}});
  }

  std::uint16_t port() const { return server_->port(); }
  json hello(Browser& page) { return page.ask("hello", {{"token", token}, {"protocol", 1}}); }

  const std::string token = random_token();
  std::atomic<int> stops_{0}, gone_{0};
  std::atomic<std::uint64_t> flood_{0};
  std::unique_ptr<UnixSocketServer> daemon_;
  std::optional<PageServer> server_;
  std::thread thread_;
};

TEST_F(PageOfBench, GivesThePageWithHeadersThatLetNothingElseIn) {
  const HttpAnswer page = http(port(), {});
  EXPECT_EQ(page.status, 200u);
  EXPECT_EQ(page.body, "<!doctype html>");
  const std::string policy(page.whole["Content-Security-Policy"]);
  EXPECT_THAT(policy, HasSubstr("default-src 'none'"));
  EXPECT_THAT(policy, testing::Not(HasSubstr("unsafe")));
  EXPECT_EQ(page.whole["X-Content-Type-Options"], "nosniff");
  EXPECT_EQ(page.whole["Referrer-Policy"], "no-referrer");
  EXPECT_EQ(http(port(), {.target = "/../etc/passwd"}).status, 404u);
}

TEST_F(PageOfBench, RefusesAnotherHostAndAnotherOrigin) {
  EXPECT_EQ(http(port(), {.host = "evil.com"}).status, 403u);
  EXPECT_EQ(http(port(), {.origin = "http://evil.com"}).status, 403u);
  EXPECT_EQ(
      http(port(), {.method = boost::beast::http::verb::post, .target = "/stop", .origin = "http://evil.com"}).status,
      403u);
  EXPECT_EQ(http(port(), {.method = boost::beast::http::verb::post, .target = "/stop"}).status, 403u) << "no origin";
  EXPECT_FALSE(Browser(port(), "evil.com", "http://evil.com").open);
  EXPECT_FALSE(Browser(port(), "localhost", "http://evil.com").open);
  EXPECT_EQ(stops_, 0);
}

TEST_F(PageOfBench, SaysNothingWithoutTheToken) {
  Browser page(port());
  ASSERT_TRUE(page.open);
  EXPECT_THAT(page.ask("status")["error"]["message"], HasSubstr("token"));
  EXPECT_THAT(page.ask("hello", {{"token", "00000000000000000000000000000000"}})["error"]["message"],
              HasSubstr("token"));
  EXPECT_FALSE(page.next()) << "it is closed";
}

TEST_F(PageOfBench, AStopNeedsNoTokenAndNoPage) {
  const HttpAnswer answer =
      http(port(), {.method = boost::beast::http::verb::post, .target = "/stop", .origin = "http://localhost"});
  EXPECT_EQ(answer.status, 200u);
  EXPECT_EQ(json::parse(answer.body), json({{"stopped", 7}, {"reference_safe", true}}));
  EXPECT_EQ(stops_, 1);
}

TEST_F(PageOfBench, AStopThatNobodyAnswersSaysSo) {
  daemon_.reset();
  const HttpAnswer answer =
      http(port(), {.method = boost::beast::http::verb::post, .target = "/stop", .origin = "http://localhost"});
  EXPECT_EQ(answer.status, 503u);
  EXPECT_TRUE(json::parse(answer.body).contains("error"));
}

TEST_F(PageOfBench, EachPageHasItsOwnConnectionToTheDaemonWhichEndsWithIt) {
  auto one = std::make_unique<Browser>(port());
  Browser two(port());
  const json welcome = hello(*one)["result"];
  EXPECT_EQ(welcome["protocol"], 1);
  EXPECT_EQ(welcome["bench"], true);
  EXPECT_EQ(welcome["daemon"], true);
  EXPECT_EQ(welcome["may_move"], true);
  hello(two);
  const json first = one->ask("status")["result"], second = two.ask("status")["result"];
  EXPECT_EQ(first["asked"], "status");
  EXPECT_NE(first["peer"], second["peer"]);
  one.reset();
  EXPECT_TRUE(eventually([&] { return gone_ == 1; }, 10));
  EXPECT_EQ(two.ask("status")["result"]["asked"], "status");
}

TEST_F(PageOfBench, WhoComesByAnotherAddressMayLookAndStopButNotMove) {
  Browser page(port(), "127.0.0.2", "http://127.0.0.2", "127.0.0.2");
  ASSERT_TRUE(page.open);
  EXPECT_EQ(hello(page)["result"]["may_move"], false);
  EXPECT_EQ(page.ask("status")["result"]["asked"], "status");
  for (const char* method : {"run", "reset", "confirm"}) {
    EXPECT_THAT(page.ask(method)["error"]["message"], HasSubstr("look and stop")) << method;
  }
  EXPECT_EQ(page.ask("stop")["result"]["asked"], "stop");
}

TEST_F(PageOfBench, PagesThatComeAndGoLeaveNothingBehind) {
  for (int round = 0; round < 200; ++round) {
    Browser page(port());
    ASSERT_TRUE(page.open) << round;
    if (round % 2 == 0) {
      ASSERT_TRUE(hello(page).contains("result")) << round;
    }
    ASSERT_EQ(http(port(), {}).status, 200u) << round;
  }
  EXPECT_TRUE(eventually([&] { return gone_ == 100; }, 10));
}

TEST_F(PageOfBench, TellsThatTheDaemonWentAndCameBack) {
  Browser page(port());
  hello(page);
  page.send(R"({"jsonrpc":"2.0","id":"slow","method":"never"})");
  page.ask("status");
  daemon_.reset();
  EXPECT_EQ(page.notification("daemon")["params"]["connected"], false);
  const auto unanswered = page.next();
  ASSERT_TRUE(unanswered);
  EXPECT_EQ((*unanswered)["id"], "slow");
  EXPECT_EQ((*unanswered)["error"]["code"], rpc::code::not_available);
  page.told.clear();
  daemon_ = std::make_unique<UnixSocketServer>(path("s"));
  serve_daemon();
  EXPECT_EQ(page.notification("daemon")["params"]["connected"], true);
  EXPECT_EQ(page.ask("status")["result"]["asked"], "status");
}

TEST_F(PageOfBench, ClosesWhoSendsTooMuchAtOnce) {
  Browser page(port());
  hello(page);
  page.send(R"({"method":"status","params":)" + std::string(100, '[') + std::string(100, ']') + "}");
  EXPECT_THAT(page.next().value_or(json()).dump(), HasSubstr("nested"));
  page.send(R"({"jsonrpc":"2.0","id":1,"method":")" + std::string(PageServer::longest_message, 'x') + "\"}");
  EXPECT_FALSE(page.next());
}

TEST_F(PageOfBench, AReaderWhoIsSlowCostsNoMemory) {
  Browser page(port());
  hello(page);
  for (int i = 0; i < 400; ++i) page.send(R"({"jsonrpc":"2.0","id":1,"method":"flood"})");  // 24 MB of answers, unread
  Browser other(port());
  hello(other);
  EXPECT_EQ(other.ask("status")["result"]["asked"], "status") << "others are served";
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmRSS:")) {
      EXPECT_LT(std::stol(line.substr(6)), 400000) << "kB";
    }
  }
}

TEST_F(PageOfBench, WhoIsSilentIsClosed) {
  Browser page(port());
  hello(page);
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_TRUE(eventually([&] { return gone_ == 1; }, 10)) << "its pings are not answered while nobody reads";
}

TEST_F(PageOfBench, ImportsAFileForWhoHasTheToken) {
  const auto put = boost::beast::http::verb::put;
  HttpRequest request{
      .method = put, .target = "/import?name=a%2Fb.csv", .origin = "http://localhost", .body = "t,omega\n"};
  EXPECT_EQ(http(port(), request).status, 403u);
  request.token = token;
  const HttpAnswer answer = http(port(), request);
  EXPECT_EQ(answer.status, 200u) << answer.body;
  EXPECT_EQ(read(json::parse(answer.body)["path"].get<std::string>()), "t,omega\n");
  EXPECT_EQ(std::filesystem::path(json::parse(answer.body)["path"].get<std::string>()).filename(), "a_b.csv");
  request.target = "/import?name=.bashrc";
  EXPECT_EQ(http(port(), request).status, 400u);
}

TEST_F(PageOfBench, ThePortIsTakenOnce) {
  EXPECT_THROW(PageServer({.port = port(),
                           .listen = "",
                           .token = "x",
                           .version = "",
                           .socket = {},
                           .imports = {},
                           .worker = {},
                           .methods = {},
                           .file = {}}),
               ProtocolError);
}

}  // namespace
}  // namespace emtb
