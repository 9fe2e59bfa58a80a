#include "server/rpc.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

namespace emtb::rpc {
namespace {

using nlohmann::json;

Methods methods() {
  Methods methods;
  methods.add("echo", [](const Params& params, const Peer&) {
    params.only({"text", "number"});
    return json{{"text", params.text("text")}, {"number", params.number_or("number", 1, 0, 10)}};
  });
  methods.add("refuse", [](const Params&, const Peer& peer) -> json {
    throw Refusal(code::busy, "busy", {{"pid", peer.pid}});
  });
  methods.add("break", [](const Params&, const Peer&) -> json { throw std::runtime_error("broken"); });
  return methods;
}

json ask(const std::string& line) {
  return json::parse(methods().answer(line, {.id = 1, .pid = 42, .uid = 0, .gid = 0}).line);
}
int code_of(const std::string& line) { return ask(line)["error"]["code"]; }

TEST(Rpc, AnswersWithTheSameId) {
  EXPECT_EQ(ask(R"({"jsonrpc":"2.0","id":7,"method":"echo","params":{"text":"a"}})"),
            json::parse(R"({"jsonrpc":"2.0","id":7,"result":{"text":"a","number":1.0}})"));
  EXPECT_EQ(ask(R"({"jsonrpc":"2.0","id":"x","method":"echo","params":{"text":"a"}})")["id"], "x");
}

TEST(Rpc, TellsMistakesByTheStandardsNumbers) {
  for (const char* line : {"", "{", "nonsense", "{\"a\":1}}", "\xff\xfe", "[1e999]", "{'a':1}"}) {
    EXPECT_EQ(code_of(line), code::parse_error) << line;
  }
  for (const char* line :
       {"[]", "1", "null", "{}", R"({"jsonrpc":"1.0","id":1,"method":"echo"})", R"({"jsonrpc":"2.0","id":1})",
        R"({"jsonrpc":"2.0","id":1,"method":5})", R"({"jsonrpc":"2.0","id":{},"method":"echo"})",
        R"({"jsonrpc":"2.0","id":1,"method":"echo","params":3})",
        R"({"jsonrpc":"2.0","id":1,"method":"echo","more":3})", R"([{"jsonrpc":"2.0","id":1,"method":"echo"}])"}) {
    EXPECT_EQ(code_of(line), code::invalid_request) << line;
  }
  EXPECT_EQ(code_of(R"({"jsonrpc":"2.0","id":1,"method":"none"})"), code::method_not_found);
  for (const char* params : {"{}", R"({"text":1})", R"({"text":"a","x":1})", R"({"text":"a","number":11})",
                             R"({"text":"a","number":"1"})", R"(["a"])", R"({"text":null})"}) {
    EXPECT_EQ(code_of(R"({"jsonrpc":"2.0","id":1,"method":"echo","params":)" + std::string(params) + "}"),
              code::invalid_params)
        << params;
  }
  EXPECT_EQ(code_of(R"({"jsonrpc":"2.0","id":1,"method":"break"})"), code::internal_error);
}

TEST(Rpc, CarriesARefusalsData) {
  const json error = ask(R"({"jsonrpc":"2.0","id":1,"method":"refuse"})")["error"];
  EXPECT_EQ(error["code"], code::busy);
  EXPECT_EQ(error["data"]["pid"], 42);
}

TEST(Rpc, ANotificationHasNoAnswer) {
  EXPECT_EQ(methods().answer(R"({"jsonrpc":"2.0","method":"echo","params":{"text":"a"}})", {}).line, "");
  EXPECT_EQ(methods().answer(R"({"jsonrpc":"2.0","method":"none"})", {}).line, "");
}

TEST(Rpc, AnswersOneValidLineToWhateverIsSent) {
  const Methods table = methods();
  std::mt19937 random(2011);
  const std::string valid = R"({"jsonrpc":"2.0","id":1,"method":"echo","params":{"text":"a","number":3}})";
  const auto check = [&](const std::string& line) {
    const std::string answer = table.answer(line, {}).line;
    if (answer.empty()) return;  // by chance a notification
    EXPECT_EQ(answer.find('\n'), std::string::npos);
    const json parsed = json::parse(answer, nullptr, false);
    ASSERT_TRUE(parsed.is_object()) << answer;
    EXPECT_EQ(parsed["jsonrpc"], "2.0");
    EXPECT_NE(parsed.contains("result"), parsed.contains("error"));
  };
  for (int i = 0; i < 20'000; ++i) {
    std::string line = valid;
    for (unsigned n = 1 + random() % 6; n > 0 && !line.empty(); --n) {
      const std::size_t at = random() % line.size();
      switch (random() % 4) {
        case 0:
          line[at] = static_cast<char>(random());
          break;
        case 1:
          line.erase(at, random() % 5);
          break;
        case 2:
          line.insert(at, 1, "{}[]\",:0e-\\u"[random() % 12]);
          break;
        default:
          line.insert(at, line.substr(random() % line.size(), random() % 8));
          break;
      }
    }
    check(line);
  }
}

TEST(Rpc, ALineOfBracketsDoesNotEndTheStack) {
  EXPECT_EQ(code_of(std::string(60'000, '[')), code::parse_error);
  const std::string request = R"({"jsonrpc":"2.0","id":1,"method":"echo","params":{"text":)";
  EXPECT_EQ(code_of(request + std::string(30'000, '[') + std::string(30'000, ']') + "}}"), code::parse_error);
  EXPECT_EQ(code_of(request + "[[[[1]]]]}}"), code::invalid_params);
}

TEST(Rpc, AnAnswerMayComeByAndBy) {
  Methods slow;
  int left = 2;
  slow.add_slow("wait", [&](const Params& params, const Peer&) -> Later {
    params.only({"in_vain"});
    return [&left, in_vain = params.flag_or("in_vain", false)]() -> json {
      if (in_vain) throw Refusal(code::not_ready, "never");
      return --left > 0 ? json() : json{{"left", left}};
    };
  });
  const Reply reply = slow.answer(R"({"jsonrpc":"2.0","id":4,"method":"wait"})", {});
  EXPECT_EQ(reply.line, "");
  ASSERT_TRUE(reply.later);
  EXPECT_EQ(reply.later(), "");
  EXPECT_EQ(json::parse(reply.later()), json::parse(R"({"jsonrpc":"2.0","id":4,"result":{"left":0}})"));
  const Reply refused = slow.answer(R"({"jsonrpc":"2.0","id":4,"method":"wait","params":{"in_vain":true}})", {});
  EXPECT_EQ(json::parse(refused.later())["error"]["code"], code::not_ready);
  EXPECT_EQ(json::parse(
                slow.answer(R"({"jsonrpc":"2.0","id":4,"method":"wait","params":{"x":1}})", {}).line)["error"]["code"],
            code::invalid_params);
}

TEST(Rpc, KnowsTheMethodOfALineThatHasOnlyBegun) {
  EXPECT_TRUE(begins_request(R"({"jsonrpc": "2.0", "id": 1, "method": "run", "params": {"profile": "name)", "run"));
  EXPECT_FALSE(begins_request(R"({"jsonrpc": "2.0", "id": 1, "method": "stop", "params": {"method": "run)", "run"));
  EXPECT_FALSE(begins_request(R"({"params": {"method": "run", "x": ")", "run"));
  EXPECT_FALSE(begins_request(R"({"params": ["method", "run", "x)", "run"));
  EXPECT_FALSE(begins_request(std::string(70'000, '['), "run"));
  EXPECT_FALSE(begins_request("", "run"));
}

}  // namespace
}  // namespace emtb::rpc
