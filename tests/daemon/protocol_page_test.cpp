#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "server/client.h"
#include "server/unix_socket.h"
#include "tests/process.h"
#include "tests/raw_client.h"
#include "tests/session/scratch.h"

namespace emtb {
namespace {

using nlohmann::json;
using testing::HasSubstr;

std::string page() {
  std::ifstream in(EMTB_DOCS "/protocol.md");
  return {std::istreambuf_iterator<char>(in), {}};
}

/// What stands below each `### NAME` of one `## PART`.
std::map<std::string, std::string> sections(const std::string& part) {
  std::istringstream in(page());
  std::map<std::string, std::string> found;
  std::string line, in_part, name;
  while (std::getline(in, line)) {
    if (line.starts_with("## ")) {
      in_part = line.substr(3);
      name.clear();
    } else if (line.starts_with("### ")) {
      name = line.substr(4);
    } else if (in_part == part && !name.empty()) {
      found[name] += line + "\n";
    }
  }
  return found;
}

/// The words in backticks of the text from `Parameters:` to the first full stop that ends a sentence.
std::set<std::string> parameters(const std::string& section) {
  std::set<std::string> names;
  const std::string text = section.substr(0, section.find("```"));
  for (const char* name :
       {"profile", "note", "operator", "brake", "rate", "model", "estimates", "bin", "last", "points"}) {
    if (text.find("`" + std::string(name) + "`") != std::string::npos) names.insert(name);
  }
  return text.starts_with("Parameters: none.") ? std::set<std::string>{} : names;
}

std::set<std::string> list_behind(const std::string& text, const std::string& word) {
  std::set<std::string> names;
  std::istringstream in(text.substr(text.find(word) + word.size()));
  std::string name;
  while (std::getline(in, name, ',')) {
    const std::size_t first = name.find_first_not_of(' ');
    if (name.substr(first) != "none") names.insert(name.substr(first));
  }
  return names;
}

/// Same members, of the same kinds; of the lists the first element stands for all. A null in the page may be anything.
void expect_shape(const json& documented, const json& answered, const std::string& where) {
  if (documented.is_null()) return;
  if (documented.is_number()) {
    EXPECT_TRUE(answered.is_number()) << where << ": " << answered;
    return;
  }
  ASSERT_EQ(std::string(documented.type_name()), answered.type_name()) << where;
  if (documented.is_array() && !documented.empty() && !answered.empty()) {
    expect_shape(documented[0], answered[0], where + "[0]");
  }
  if (!documented.is_object()) return;
  for (const auto& [key, value] : documented.items()) {
    ASSERT_TRUE(answered.contains(key)) << where << "." << key << " is documented, but not answered";
    expect_shape(value, answered[key], where + "." + key);
  }
  if (where.ends_with("signals") || where.ends_with("error")) return;  // one signal stands for all; data may be there
  for (const auto& [key, value] : answered.items()) {
    EXPECT_TRUE(documented.contains(key)) << where << "." << key << " is answered, but not documented";
  }
}

class ProtocolPage : public Scratch {
 protected:
  ProtocolPage() {
    std::string text = read(std::filesystem::path(EMTB_CONFIG) / "benches/fh2-simulated.yaml");
    const std::size_t estimates = text.find("\nestimates:"), devices = text.find("\ndevices:");
    text.erase(estimates, devices - estimates);  // the page's bench names no model
    const auto bench = write("bench.yaml", text);
    emtbd_ = std::make_unique<Process>(std::vector<std::string>{EMTBD, "--config", bench, "--socket", path("s"),
                                                                "--data", path("data"), "--pace", "max"},
                                       path("emtbd"));
    EXPECT_TRUE(eventually([&] {
      const RawClient probe(path("s"));
      return probe.connected;
    }));
  }
  json ask(RawClient& client, const json& request) {
    client.send(request.dump() + "\n");
    return json::parse(client.line());
  }

  std::unique_ptr<Process> emtbd_;
};

TEST_F(ProtocolPage, ListsEveryMethodAndItsParametersAndNoOther) {
  RawClient client(path("s"));
  const auto documented = sections("Methods");
  std::set<std::string> names;
  for (const auto& [name, text] : documented) names.insert(name);
  const json none = ask(client, {{"jsonrpc", "2.0"}, {"id", 1}, {"method", "explode"}});
  EXPECT_EQ(names, list_behind(none["error"]["message"], "Known:"));
  for (const auto& [name, text] : documented) {
    const json refused = ask(client, {{"jsonrpc", "2.0"}, {"id", 2}, {"method", name}, {"params", {{"nonsense", 1}}}});
    ASSERT_EQ(refused["error"]["code"], rpc::code::invalid_params) << refused;
    EXPECT_EQ(parameters(text), list_behind(refused["error"]["message"], "Known:")) << name;
  }
}

TEST_F(ProtocolPage, ListsEveryCodeAndLimit) {
  std::map<int, std::string> documented, real;
  std::istringstream in(page());
  std::string line;
  while (std::getline(in, line)) {
    int number = 0;
    char name[64] = "";
    if (std::sscanf(line.c_str(), "| %d | `%63[a-z_]` |", &number, name) == 2) documented[number] = name;
  }
  for (const auto& [number, name] : rpc::code::names) real[number] = name;
  EXPECT_EQ(documented, real);
  EXPECT_THAT(page(), HasSubstr("| a line | " + std::to_string(UnixSocketServer::longest_line) + " bytes; of `run` " +
                                std::to_string(UnixSocketServer::longest_run) + " "));
  EXPECT_THAT(page(), HasSubstr("| " + std::to_string(UnixSocketServer::longest_queue) + " bytes |"));
  EXPECT_THAT(page(), HasSubstr("| clients | " + std::to_string(UnixSocketServer::most_clients) + " |"));
  EXPECT_THAT(page(),
              HasSubstr("| " + std::to_string(static_cast<int>(UnixSocketServer::most_requests)) + " a second"));
}

TEST_F(ProtocolPage, EachExampleIsAnsweredAsItSays) {
  RawClient client(path("s"));
  std::map<std::string, json> notifications;
  for (const auto& [name, text] : sections("Notifications")) {
    const auto at = text.find("< ") + 2;
    notifications[name] = json::parse(text.substr(at, text.find('\n', at) - at));
  }
  std::set<std::string> seen;
  const auto next = [&] {
    json message = json::parse(client.line());
    if (message.contains("method")) {
      seen.insert(message["method"]);
      expect_shape(notifications[message["method"]], message, message["method"]);
    }
    return message;
  };
  std::istringstream in(page());
  std::string line, request;
  int examples = 0;
  bool ended = true;
  while (std::getline(in, line) && !HasFatalFailure()) {
    if (line.starts_with("> ")) request = line.substr(2);
    if (!line.starts_with("< ") || request.empty()) continue;
    const json documented = json::parse(line.substr(2));
    client.send(request + "\n");
    json answer;
    do {
      answer = next();
    } while (answer.contains("method"));
    EXPECT_EQ(documented["id"], answer["id"]);
    expect_shape(documented, answer, request);
    if (documented.contains("error")) {
      EXPECT_EQ(documented["error"]["code"], answer["error"]["code"]) << answer;
    }
    if (answer.contains("result") && answer["result"].contains("run") && answer["result"].contains("session")) {
      for (ended = false; !ended;) ended = next()["method"] == "ended";  // the next example finds the bench at rest
    }
    request.clear();
    ++examples;
  }
  EXPECT_GE(examples, 10);
  while (!seen.contains("live")) next();
  EXPECT_TRUE(seen.contains("ended"));
}

}  // namespace
}  // namespace emtb
