#include <gmock/gmock.h>
#include <sys/resource.h>
#include <unistd.h>

#include <fstream>
#include <vector>

#include "server/unix_socket.h"
#include "session/spec.h"
#include "tests/daemon/bench_in_service.h"
#include "tests/raw_client.h"

namespace emtb {
namespace {

using nlohmann::json;
using testing::HasSubstr;

/// Nothing takes the stop away: neither the controller's own flood, nor others' connections, nor slow requests.
class StopTest : public BenchInService {
 protected:
  void run_endless(RawClient& owner) {
    const auto ask = [&](const std::string& method, const json& params) {
      owner.send(json{{"jsonrpc", "2.0"}, {"id", 1}, {"method", method}, {"params", params}}.dump() + "\n");
      const json answer = json::parse(owner.line(), nullptr, false);
      EXPECT_TRUE(answer.is_object() && answer.contains("result")) << answer;
    };
    ask("reset", json::object());
    ask("run", {{"profile", endless}});
    EXPECT_TRUE(eventually([&] { return output->volts == 3; }));
  }
  /// No reading comes, and is not missed yet: arming goes on.
  void start_with_a_silent_card() {
    card_period = 100;  // [s]
    start();
    card->failure = Failure::stall;
  }
  static void ask_to_arm(const RawClient& client) {
    client.send(R"({"jsonrpc":"2.0","id":1,"method":"reset"})"
                "\n");
  }
  json stop() { return stop_now(path("sock")); }
};

TEST_F(StopTest, AControllerThatDiesBehindAFloodOfItsOwnTakesItsRunWithIt) {
  slow = true;
  start();
  Client other(path("sock"));
  {
    RawClient owner(path("sock"));
    run_endless(owner);
    owner.send_what_fits(std::string(233'000, '\n'));  // minutes of them, at the rate that is answered
  }
  EXPECT_TRUE(eventually([&] { return output->volts == 0; }, 10));
  EXPECT_EQ(other.call("status", {})["fault"]["name"], "client_lost");
}

TEST_F(StopTest, ToConnectIsToStopAndOneLineAnswersWhenTheReferenceIsSafe) {
  slow = true;
  start();
  RawClient owner(path("sock"));
  run_endless(owner);
  RawClient stop(path("sock.stop"));
  ASSERT_TRUE(stop.connected);
  const json answer = json::parse(stop.line());
  EXPECT_EQ(output->volts, 0) << "before the answer, not after it";
  EXPECT_EQ(answer, json({{"stopped", 1}, {"reference_safe", true}}));
  stop.line();
  EXPECT_TRUE(stop.ended) << "one line, then the end";
}

TEST_F(StopTest, WithoutARunItStopsNothingAndLeavesTheBenchArmed) {
  start();
  Client client(path("sock"));
  client.call("reset", {});
  EXPECT_EQ(stop(), json({{"stopped", nullptr}, {"reference_safe", true}}));
  EXPECT_EQ(client.call("status", {})["state"], "armed");
  client.call("subscribe", {{"rate", 50}});
  client.call("run", {{"profile", level}});
  EXPECT_EQ(end_of_run(client)["outcome"], "done") << "a stop is of what was asked before it";
}

TEST_F(StopTest, ItStopsWhereEveryPlaceAtTheSocketIsTaken) {
  slow = true;
  start();
  RawClient owner(path("sock"));
  run_endless(owner);
  std::vector<std::unique_ptr<RawClient>> crowd;
  for (std::size_t i = 1; i < UnixSocketServer::most_clients; ++i) {
    crowd.push_back(std::make_unique<RawClient>(path("sock")));
    crowd.back()->send(R"({"jsonrpc":"2.0","id":1,"method":"config"})"
                       "\n");
    ASSERT_NE(crowd.back()->line(), "");
  }
  EXPECT_EQ(stop()["stopped"], 1);
  EXPECT_EQ(output->volts, 0);
}

TEST_F(StopTest, ItStopsWhereTheProcessHasNoDescriptorLeft) {
  slow = true;
  start();
  RawClient owner(path("sock"));
  run_endless(owner);
  RawClient caller;  // has its descriptor before the others run out: what is tested is that the bench's do not
  rlimit before{};
  getrlimit(RLIMIT_NOFILE, &before);
  const rlimit tight{.rlim_cur = 64, .rlim_max = before.rlim_max};
  setrlimit(RLIMIT_NOFILE, &tight);
  std::vector<int> all;
  for (int file = dup(0); file >= 0; file = dup(0)) all.push_back(file);
  EXPECT_FALSE(all.empty());
  caller.connect(path("sock.stop"));
  const std::string answer = caller.line();
  for (const int file : all) close(file);
  setrlimit(RLIMIT_NOFILE, &before);
  EXPECT_EQ(json::parse(answer, nullptr, false), json({{"stopped", 1}, {"reference_safe", true}}));
  EXPECT_EQ(output->volts, 0);
}

TEST_F(StopTest, ItEndsAnArmingAndAResetThatWaitsKeepsNobodyElseWaiting) {
  start_with_a_silent_card();
  RawClient arming(path("sock"));
  ask_to_arm(arming);
  Client other(path("sock"));
  ASSERT_TRUE(eventually([&] { return other.call("status", {})["state"] == "arming"; }))
      << "others are answered meanwhile";
  stop();
  EXPECT_THAT(arming.line(), HasSubstr("a stop came meanwhile"));
  EXPECT_EQ(other.call("status", {})["state"], "latched");
  EXPECT_TRUE(other.call("status", {})["fault"].is_null());
}

TEST_F(StopTest, TheMethodEndsAnArmingToo) {
  start_with_a_silent_card();
  RawClient arming(path("sock"));
  ask_to_arm(arming);
  Client other(path("sock"));
  ASSERT_TRUE(eventually([&] { return other.call("status", {})["state"] == "arming"; }));
  other.call("stop", {});
  EXPECT_THAT(arming.line(), HasSubstr("a stop came meanwhile"));
}

TEST_F(StopTest, AModelThatIsTooMuchIsRefusedAndKeepsNobodyWaiting) {
  start();
  Client client(path("sock"));
  const std::string base = read(std::filesystem::path(EMTB_CONFIG) / "models/fh2.yaml");
  const std::string head = base.substr(0, base.find("effects:"));
  const auto why = [&](const std::string& effects) {
    return message_of<rpc::Refusal>([&] { client.call("estimates", {{"model", head + "effects:\n" + effects}}); });
  };
  const auto formulas = [](int count) {
    std::string text;
    for (int i = 0; i < count; ++i) {
      const std::string n = std::to_string(i);
      text += "  f" + n + ": {torque: \"-c" + n + "*omega^3\", parameters: {c" + n +
              ": {value: 0, min: 0, max: 1.0e-6, unit: N m s3/rad3}}}\n";
    }
    return text;
  };
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_THAT(why(formulas(500)), HasSubstr("has 500 effects, but a daemon follows at most 40"));
  EXPECT_THAT(why(formulas(30)), HasSubstr("has 30 formulas, but a daemon follows at most 8"));
  std::string parameters;
  for (int i = 0; i < 200; ++i) {
    parameters += (i == 0 ? "" : ", ") + ("p" + std::to_string(i)) + ": {value: 0, min: 0, max: 1, unit: N m}";
  }
  EXPECT_THAT(why("  f: {torque: \"-p0\", parameters: {" + parameters + "}}\n"), HasSubstr("has 200 parameters"));
  EXPECT_THAT(why("  f: {torque: \"" + std::string(2000, '1') + "\", parameters: {}}\n"),
              HasSubstr("longer than 1000"));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(20));
}

TEST_F(StopTest, ARunTakesNoPathOfAnothersChoice) {
  start();
  Client client(path("sock"));
  client.call("reset", {});
  const std::string mine = write("mine.yaml", level);
  ASSERT_EQ(mkfifo(path("pipe").c_str(), 0600), 0);
  for (const std::string& given : {mine, path("pipe").string(), std::string("/dev/zero"), std::string("../level"),
                                   std::string(), std::string(5000, 'a') + "/"}) {
    EXPECT_EQ(refusal(client, "run", {{"profile", given}}), rpc::code::bad_profile) << given;
  }
  const std::string why = message_of<rpc::Refusal>([&] {
    client.call("run", {{"profile", std::string(5000, 'a') + "/"}});
  });
  EXPECT_LT(why.size(), 300u) << why;
  EXPECT_EQ(client.call("status", {})["state"], "armed");
}

TEST_F(StopTest, ARunMayHaveMorePointsThanAnyOtherRequest) {
  start();
  Client client(path("sock"));
  client.call("reset", {});
  client.call("subscribe", {{"rate", 1}});
  std::string times = "0", values = "1";
  for (int i = 1; i < 30'000; ++i) {
    times += ", " + std::to_string(i) + "e-5";
    values += i % 2 == 0 ? ", 1.0001" : ", 1.0002";
  }
  const std::string profile = "name: dense\nkind: knots\ntimes: [" + times + "]\nvalues: [" + values + "]\n";
  ASSERT_GT(profile.size(), 4 * UnixSocketServer::longest_line);
  client.call("run", {{"profile", profile}});
  EXPECT_EQ(end_of_run(client)["outcome"], "done");
  RawClient other(path("sock"));
  other.send(R"({"jsonrpc":"2.0","id":1,"method":"estimates","params":{"model":")" +
             std::string(UnixSocketServer::longest_line, 'x'));
  EXPECT_THAT(other.line(), HasSubstr("longer than 65536 bytes"));
}

TEST_F(StopTest, ARecordingThatIsCutOrWrittenOverEndsTheRun) {
  slow = true;
  start();
  Client client(path("sock"));
  client.call("subscribe", {{"rate", 1}});
  for (const bool cut : {false, true}) {
    client.call("reset", {});
    const json started = client.call("run", {{"profile", endless}});
    EXPECT_TRUE(eventually([&] { return output->volts == 3; }));
    flush_waits = false;
    disk_busy = true;  // between two looks at the file, not while HDF5 writes its beginning anew
    EXPECT_TRUE(eventually([&] { return flush_waits.load(); }));
    const std::filesystem::path file = started["session"].get<std::string>();
    if (cut) {
      std::filesystem::resize_file(file, 0);
    } else {
      std::fstream(file, std::ios::in | std::ios::out | std::ios::binary) << "noise from elsewhere";
    }
    disk_busy = false;
    const json end = end_of_run(client);
    EXPECT_EQ(end["outcome"], "fault") << end;
    EXPECT_EQ(end["fault"]["code"], 501);
    EXPECT_FALSE(end["complete"]);
    EXPECT_EQ(output->volts, 0);
  }
}

TEST_F(StopTest, ARecordingThatIsDeletedEndsTheRunAndIsNeverCalledComplete) {
  slow = true;
  start();
  Client client(path("sock"));
  client.call("subscribe", {{"rate", 1}});
  for (const bool moved : {false, true}) {
    client.call("reset", {});
    const json started = client.call("run", {{"profile", endless}});
    EXPECT_TRUE(eventually([&] { return output->volts == 3; }));
    const std::filesystem::path file = started["session"].get<std::string>();
    if (moved) {
      std::filesystem::rename(file, path("elsewhere.h5"));
      write(file.filename(), "another's");
    } else {
      std::filesystem::remove(file);
    }
    const json end = end_of_run(client);
    EXPECT_EQ(end["outcome"], "fault") << end;
    EXPECT_EQ(end["fault"]["code"], 501);
    EXPECT_THAT(end["fault"]["text"].get<std::string>(), HasSubstr("not there any more"));
    EXPECT_FALSE(end["complete"]);
    EXPECT_EQ(output->volts, 0);
  }
}

}  // namespace
}  // namespace emtb
