#include "tests/daemon/bench_in_service.h"

#include <gmock/gmock.h>

#include <future>

#include "session/session.h"
#include "session/spec.h"

namespace emtb {
namespace {

using nlohmann::json;
using testing::HasSubstr;

TEST_F(BenchInService, WhatAProfileNeedsIsAskedBeforeTheRun) {
  start();
  Client client(path("sock"));
  client.call("reset", {});
  const auto why = [&](const std::string& needs) {
    return message_of<rpc::Refusal>([&] { client.call("run", {{"profile", level + needs}}); });
  };
  card->set(Signal::omega, 100);
  ASSERT_TRUE(eventually([&] { return client.call("status", {})["signals"]["omega"]["value"] == 100; }));
  EXPECT_EQ(refusal(client, "run", {{"profile", level + std::string("needs: {at_rest: true}\n")}}),
            rpc::code::not_ready);
  EXPECT_THAT(why("needs: {at_rest: true}\n"), HasSubstr("profile level needs the motor at rest"));
  EXPECT_THAT(why("needs: {temperature: 30}\n"), HasSubstr("which this bench does not measure"));
  EXPECT_THAT(why("needs: {field: true}\n"), HasSubstr("field: {min: ...}"));
  EXPECT_THAT(why("kind: from_csv\n"), HasSubstr("kind"));
  card->set(Signal::omega, 0.5);
  ASSERT_TRUE(eventually([&] { return client.call("status", {})["signals"]["omega"]["value"] == 0.5; }));
  client.call("subscribe", {{"rate", 50}});
  client.call("run", {{"profile", level + std::string("needs: {at_rest: true, idle: 10}\n")}});
  EXPECT_EQ(end_of_run(client)["outcome"], "done") << "no run before: cold";
  EXPECT_THAT(why("needs: {idle: 10}\n"), HasSubstr("10.0 min without a run"));
}

// Who was let in before the guardian knew of it could arm a daemon that nobody ends when it stands still.
TEST_F(BenchInService, LetsNobodyInBeforeItHasToldThatItIsAtWork) {
  std::future<bool> answered;
  at_work = [&] {
    answered = std::async(std::launch::async, [&] {
      return eventually([&] {
        try {
          return !Client(path("sock")).call("status", {}).empty();
        } catch (const ProtocolError&) {
          return false;
        }
      });
    });
    EXPECT_EQ(answered.wait_for(std::chrono::milliseconds(200)), std::future_status::timeout);
  };
  start();
  ASSERT_TRUE(answered.valid());
  EXPECT_TRUE(answered.get());
}

TEST_F(BenchInService, WaitsForAPersonWhereAProfileSaysSo) {
  start();
  Client client(path("sock"));
  client.call("reset", {});
  client.call("subscribe", {{"rate", 50}});
  EXPECT_EQ(refusal(client, "confirm"), rpc::code::not_available);
  const std::string paused = level + std::string("pauses: [{at: 0.1, say: set the brake, within: 3000}]\n");
  const json started = client.call("run", {{"profile", paused}, {"brake", "0.2 N m"}});
  json run;
  ASSERT_TRUE(eventually([&] { return (run = client.call("status", {})["run"])["pause"].is_object(); }));
  EXPECT_EQ(run["pause"]["say"], "set the brake");
  ASSERT_TRUE(eventually([&] { return client.call("status", {})["run"]["t"] > 0.2; }));
  EXPECT_NEAR(client.call("status", {})["run"]["done"].get<double>(), 0.1, 1e-3)
      << "the profile waits, the run goes on";
  Client(path("sock")).call("confirm", {});  // from another terminal
  EXPECT_EQ(end_of_run(client)["outcome"], "done");
  const Session session = read_session(started["session"].get<std::string>());
  EXPECT_EQ(session.attributes.at("brake"), "0.2 N m");
  EXPECT_TRUE(std::ranges::any_of(session.events, [](const Event& e) { return e.text == "pause 1: confirmed"; }));
}

TEST_F(BenchInService, ADiskThatIsBusyDelaysNoLiveEstimate) {
  slow = true;
  start();
  Client client(path("sock"));
  client.call("reset", {});
  client.call("subscribe", {{"rate", 50}});
  client.call("estimates", {{"model", read(std::filesystem::path(EMTB_CONFIG) / "models/fh2.yaml")}});
  client.call("run", {{"profile", endless}});
  const auto samples = [&] { return client.call("estimates", {})["samples"].get<int>(); };
  EXPECT_TRUE(eventually([&] { return samples() > 50; }));
  disk_busy = true;
  EXPECT_TRUE(eventually([&] { return flush_waits.load(); }));
  std::this_thread::sleep_for(std::chrono::milliseconds(200));  // what was on its way is in
  const int before = samples();
  EXPECT_TRUE(eventually([&] { return samples() > before + 100; })) << before;
  disk_busy = false;
  client.call("stop", {});
  EXPECT_EQ(end_of_run(client)["outcome"], "stopped");
}

TEST_F(BenchInService, RunsAnExperimentOverTheSocketFromEndToEnd) {
  start();
  Client client(path("sock"));
  EXPECT_EQ(client.call("status", {})["state"], "latched");
  EXPECT_EQ(refusal(client, "run", {{"profile", level}}), rpc::code::latched);
  EXPECT_EQ(client.call("reset", {})["state"], "armed");
  client.call("subscribe", {{"rate", 50}});
  const json started = client.call("run", {{"profile", level}, {"note", "a note"}, {"operator", "me"}});
  const json end = end_of_run(client);
  EXPECT_EQ(end["outcome"], "done") << end;
  EXPECT_EQ(end["session"], started["session"]);
  EXPECT_EQ(client.call("status", {})["state"], "armed");
  EXPECT_EQ(client.call("status", {})["last_run"]["outcome"], "done");

  const Session session = read_session(end["session"].get<std::string>());
  EXPECT_TRUE(session.complete);
  EXPECT_EQ(session.attributes.at("note"), "a note");
  EXPECT_EQ(session.attributes.at("operator"), "me");
  EXPECT_EQ(session.attributes.at("profile"), "level");
  EXPECT_EQ(session.config, bench);
  ASSERT_EQ(session.runs.size(), 1u);
  const Series& u = session.runs[0].at(Signal::u_ref);
  EXPECT_NEAR(static_cast<double>(u.t.size()), 701, 1);
  EXPECT_NEAR(u.t.back(), 0.7, 2e-3);
  EXPECT_EQ(*std::ranges::max_element(u.value), 3);
}

TEST_F(BenchInService, ANearlyFullDiskRefusesARunAndEndsOneWell) {
  slow = true;
  start();
  Client client(path("sock"));
  client.call("reset", {});
  room = disk_reserve + 1000;
  EXPECT_EQ(refusal(client, "run", {{"profile", level}}), rpc::code::cannot_record);
  room = 1ull << 40;
  client.call("subscribe", {{"rate", 1}});
  client.call("run", {{"profile", endless}});
  room = disk_reserve - 1;
  const json end = end_of_run(client);
  EXPECT_EQ(end["fault"]["code"], 503) << end;
  EXPECT_TRUE(end["complete"]);
  EXPECT_TRUE(read_session(end["session"].get<std::string>()).complete);
  EXPECT_EQ(client.call("status", {})["fault"]["name"], "disk_nearly_full");
}

TEST_F(BenchInService, AFaultLeavesABlackBoxBesideTheSessions) {
  start();
  Client client(path("sock"));
  client.call("reset", {});
  EXPECT_TRUE(client.call("status", {})["black_box"].is_null());
  card->set(Signal::omega, 200);
  ASSERT_TRUE(eventually([&] { return client.call("status", {})["black_box"].is_string(); }));
  const std::string file = client.call("status", {})["black_box"];
  EXPECT_THAT(file, testing::EndsWith("-blackbox.h5"));
  const Session session = read_session(file);
  EXPECT_THAT(session.attributes.at("note"), HasSubstr("over_speed"));
  EXPECT_EQ(session.runs.at(0).at(Signal::omega).value.back(), 200);
  EXPECT_TRUE(session.runs.at(0).has(Signal::u_ref));
}

TEST_F(BenchInService, OneControlsOthersReadAndAnybodyStops) {
  slow = true;
  start();
  Client owner(path("sock"));
  Client other(path("sock"));
  owner.call("reset", {});
  owner.call("subscribe", {});
  owner.call("run", {{"profile", endless}});
  EXPECT_EQ(refusal(other, "run", {{"profile", level}}), rpc::code::busy);
  EXPECT_EQ(refusal(other, "reset"), rpc::code::busy);
  try {
    other.call("run", {{"profile", level}});
  } catch (const rpc::Refusal& e) {
    ASSERT_NE(e.data(), nullptr);
    EXPECT_EQ((*e.data())["who"]["pid"], getpid());
  }
  const json status = other.call("status", {});
  EXPECT_EQ(status["run"]["controller"]["uid"], getuid());
  EXPECT_EQ(status["clients"].size(), 2u);
  other.call("stop", {});
  const json end = end_of_run(owner);
  EXPECT_EQ(end["outcome"], "stopped");
  EXPECT_EQ(output->volts, 0);
}

TEST_F(BenchInService, AClientThatGoesTakesItsRunWithIt) {
  slow = true;
  start();
  Client other(path("sock"));
  {
    Client owner(path("sock"));
    owner.call("reset", {});
    owner.call("run", {{"profile", endless}});
    EXPECT_TRUE(eventually([&] { return output->volts == 3; }));
  }
  EXPECT_TRUE(eventually([&] { return other.call("status", {})["state"] == "latched"; }));
  EXPECT_EQ(other.call("status", {})["fault"]["name"], "client_lost");
  EXPECT_EQ(output->volts, 0);
}

TEST_F(BenchInService, AFaultEndsTheRunNamesItAndIsInTheSession) {
  slow = true;
  start();
  Client client(path("sock"));
  client.call("reset", {});
  client.call("subscribe", {});
  client.call("run", {{"profile", endless}});
  EXPECT_TRUE(eventually([&] { return output->volts == 3; }));
  card->set(Signal::omega, 200);
  const json end = end_of_run(client);
  EXPECT_EQ(end["outcome"], "fault");
  EXPECT_EQ(end["fault"]["code"], 101);
  EXPECT_THAT(end["fault"]["text"].get<std::string>(), HasSubstr("omega = 200 rad/s"));
  EXPECT_EQ(output->volts, 0);
  EXPECT_EQ(refusal(client, "reset"), rpc::code::cause_stands);
  card->set(Signal::omega, 0);
  EXPECT_EQ(client.call("reset", {})["state"], "armed");
  const Session session = read_session(end["session"].get<std::string>());
  EXPECT_TRUE(std::ranges::any_of(session.events, [](const Event& e) { return e.code == 101; }));
}

TEST_F(BenchInService, RefusesProfilesThatTheBenchCannotTake) {
  start();
  Client client(path("sock"));
  client.call("reset", {});
  EXPECT_EQ(refusal(client, "run", {{"profile", "no_such"}}), rpc::code::bad_profile);
  EXPECT_EQ(refusal(client, "run", {{"profile", "name: x\nkind: nonsense\n"}}), rpc::code::bad_profile);
  EXPECT_EQ(refusal(client, "run", {{"profile", "name: x\nkind: step\nlevel: 9\nbefore: 1\nhold: 1\nafter: 1\n"}}),
            rpc::code::bad_profile);
  EXPECT_EQ(refusal(client, "run", json::object()), rpc::code::invalid_params);
  EXPECT_EQ(refusal(client, "run", {{"profile", 3}}), rpc::code::invalid_params);
  EXPECT_EQ(refusal(client, "subscribe", {{"rate", 51}}), rpc::code::invalid_params);
  EXPECT_EQ(refusal(client, "estimates"), rpc::code::not_available);
  EXPECT_EQ(client.call("config", {})["text"], bench);
  EXPECT_EQ(client.call("status", {})["state"], "armed") << "nothing of that touched the bench";
}

TEST_F(BenchInService, EndingInMidRunMakesSafeAndCompletesTheSession) {
  slow = true;
  start();
  Client client(path("sock"));
  client.call("reset", {});
  const json started = client.call("run", {{"profile", endless}});
  EXPECT_TRUE(eventually([&] { return output->volts == 3; }));
  std::atomic<double> last{-1};
  daemon_->terminate();
  last = output->volts.load();
  EXPECT_EQ(last, 0);
  daemon_.reset();
  const Session session = read_session(started["session"].get<std::string>());
  EXPECT_TRUE(session.complete);
  EXPECT_TRUE(std::ranges::any_of(session.events, [](const Event& e) { return e.code == 701; }));
}

TEST_F(BenchInService, ManyRunsInARowEachHaveTheirOwnFile) {
  start();
  Client client(path("sock"));
  client.call("reset", {});
  client.call("subscribe", {{"rate", 0.1}});
  std::set<std::string> files;
  for (int i = 0; i < 5; ++i) {
    client.call("run", {{"profile", level}});
    const json end = end_of_run(client);
    EXPECT_EQ(end["outcome"], "done") << end;
    files.insert(end["session"]);
  }
  EXPECT_EQ(files.size(), 5u);
}

TEST_F(BenchInService, IdleIsCountedByAClockThatNobodySets) {
  const auto file = write("before.h5", "");
  std::filesystem::last_write_time(file, std::filesystem::file_time_type::clock::now() + std::chrono::hours(1));
  start();
  Client client(path("sock"));
  client.call("reset", {});
  const auto why = [&] {
    return message_of<rpc::Refusal>([&] {
      client.call("run", {{"profile", level + std::string("needs: {idle: 20}\n")}});
    });
  };
  EXPECT_THAT(why(), HasSubstr("ended 0.0 min ago")) << "a session of the future says only that the clock was set";
  std::filesystem::last_write_time(file, std::filesystem::file_time_type::clock::now() - std::chrono::hours(1));
  EXPECT_THAT(why(), HasSubstr("ended 0.0 min ago")) << "whatever the files say later";
}

}  // namespace
}  // namespace emtb
