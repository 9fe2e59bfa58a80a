#include "tests/mutations.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "server/rpc.h"

namespace emtb::rpc {
namespace {

TEST(RequestMutations, EachIsAnsweredByOneLineOfJson) {
  Methods methods;
  methods.add("echo", [](const Params& params, const Peer&) {
    params.only({"text", "number", "flag"});
    return nlohmann::json{{"text", params.text_or("text", "")}, {"number", params.number_or("number", 1, 0, 10)}};
  });
  const std::vector<std::string> seeds{
      R"({"jsonrpc":"2.0","id":7,"method":"echo","params":{"text":"a","number":3}})",
      R"({"jsonrpc": "2.0", "id": "x", "method": "echo", "params": {"text": "\u00e4\n", "flag": true}})",
      R"([{"jsonrpc":"2.0","id":1,"method":"echo"}])"};
  read_mutations(seeds, 20'000, [&](const std::string& text) {
    begins_request(text, "echo");
    const std::string line = methods.answer(text, {}).line;
    if (line.empty()) return;  // a notification
    EXPECT_EQ(line.find('\n'), std::string::npos);
    EXPECT_TRUE(nlohmann::json::accept(line)) << line;
    EXPECT_LT(line.size(), 1000U) << line;
  });
}

}  // namespace
}  // namespace emtb::rpc
