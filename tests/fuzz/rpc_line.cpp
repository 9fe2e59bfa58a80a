#include <nlohmann/json.hpp>

#include "server/rpc.h"
#include "tests/fuzz/refusal.h"
#include "tests/fuzz/targets.h"

namespace emtb::fuzz {
namespace {

const rpc::Methods& methods() {
  static const rpc::Methods all = [] {
    rpc::Methods some;
    some.add("echo", [](const rpc::Params& params, const rpc::Peer&) {
      params.only({"text", "number", "flag"});
      return nlohmann::json{{"text", params.text_or("text", "")},
                            {"number", params.number_or("number", 1, 0, 10)},
                            {"flag", params.flag_or("flag", false)}};
    });
    some.add_slow("later", [](const rpc::Params& params, const rpc::Peer&) -> rpc::Later {
      return [text = params.text("text")] { return nlohmann::json(text); };
    });
    return some;
  }();
  return all;
}

void must_be_an_answer(const std::string& line) {
  must(line.find('\n') == std::string::npos, "an answer is one line");
  must(line.size() < 100'000, "an answer is no longer than what was asked");
  must(nlohmann::json::accept(line), "an answer is JSON: " + line);
}

}  // namespace

void rpc_line(std::string_view bytes) {
  rpc::begins_request(bytes, "echo");
  const rpc::Reply reply = methods().answer(bytes, {});
  if (!reply.line.empty()) must_be_an_answer(reply.line);
  if (reply.later) must_be_an_answer(reply.later());
  try {
    rpc::parsed_request(bytes);
  } catch (const rpc::Refusal& e) {
    must_be_an_answer(rpc::error_line(e.code(), e.what()));
  }
}

}  // namespace emtb::fuzz
