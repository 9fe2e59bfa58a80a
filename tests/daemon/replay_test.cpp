#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "hal/fault.h"
#include "session/session.h"
#include "session/spec.h"
#include "tests/emtbd.h"
#include "tests/session/scratch.h"

namespace emtb {
namespace {

using nlohmann::json;
using testing::HasSubstr;

const char* const up_and_down = "name: up_and_down\nkind: staircase\nlevels: [2, 4]\nbefore: 0.5\nhold: 2\nafter: 1\n";
const char* const short_step = "name: short_step\nkind: step\nlevel: 2\nbefore: 0.2\nhold: 0.8\nafter: 0.2\n";

/// Sessions of the simulated FH2 bench, with its slow meter, and what emtbd makes of them when it plays them again.
class Replaying : public Scratch {
 protected:
  Replaying() { bench_ = write("bench.yaml", read(std::filesystem::path(EMTB_CONFIG) / "benches/fh2-simulated.yaml")); }

  std::vector<std::string> words(const std::vector<std::string>& more) const {
    return emtbd_words(bench_, path(""), more);
  }

  /// How one run of a daemon ended.
  json run(const std::vector<std::string>& more, const std::string& profile) {
    Process emtbd(words(more), path("emtbd" + std::to_string(++launched_)));
    const auto daemon = client_of(emtbd, path("s"));
    if (!daemon) throw std::runtime_error(emtbd.err());
    const json end = run_to_its_end(*daemon, profile);
    EXPECT_FALSE(end.is_null()) << emtbd.err();
    emtbd.signal(SIGTERM);
    EXPECT_EQ(emtbd.wait(), 0) << emtbd.err();
    return end;
  }

  std::string record(const std::string& profile, const std::string& pace) {
    const json end = run({"--pace", pace}, profile);
    EXPECT_EQ(end["outcome"], "done") << end;
    return end["session"];
  }

  json replay(const std::string& session, const std::string& pace = "max") {
    return run({"--replay", session, "--pace", pace}, "replay");
  }

  static void expect_same(const Session& original, const Session& replayed) {
    ASSERT_EQ(original.runs.size(), 1u);
    ASSERT_EQ(replayed.runs.size(), 1u);
    ASSERT_EQ(replayed.runs[0].signals.size(), original.runs[0].signals.size());
    for (const auto& [signal, series] : original.runs[0].signals) {
      const Series& again = replayed.runs[0].at(signal);
      EXPECT_EQ(again.t, series.t) << info(signal).name;  // bit by bit: no tolerance
      EXPECT_EQ(again.value, series.value) << info(signal).name;
      EXPECT_EQ(again.window, series.window) << info(signal).name;
      EXPECT_EQ(again.lsb, series.lsb) << info(signal).name;
      if (signal != Signal::u_ref) {
        EXPECT_EQ(again.source, series.source);
      }
    }
  }

  /// A session of which one signal was changed.
  template <class Change>
  std::string edited(const std::string& session, const std::string& name, Signal signal, Change change) {
    Session copy = read_session(session);
    change(copy.runs.at(0).signals.at(signal));
    const auto file = path(name);
    write_session(file, copy);
    return file;
  }

  std::filesystem::path bench_;

 private:
  int launched_ = 0;
};

TEST_F(Replaying, RecordsEverySampleAnewSlowMeterIncluded) {
  const std::string session = record(up_and_down, "max");
  const Session original = read_session(session);
  EXPECT_GT(original.runs.at(0).at(Signal::omega).t.size(), 5000u);
  EXPECT_GT(original.runs.at(0).at(Signal::i_a).window, 0.1) << "a multimeter";
  const json end = replay(session);
  EXPECT_EQ(end["outcome"], "done") << "a healthy session raises no fault: " << end;
  const Session replayed = read_session(end["session"].get<std::string>());
  expect_same(original, replayed);
  EXPECT_EQ(replayed.attributes.at("profile"), "up_and_down");
  EXPECT_EQ(replayed.attributes.at("replay_of"), session);
  EXPECT_TRUE(std::ranges::none_of(replayed.events, [](const Event& e) { return e.code >= 100; }));
}

TEST_F(Replaying, ARunInRealTimeIsTheSameAgainWithItsLateTicksAndGaps) {
  const std::string session = record(short_step, "1");  // wakes when the machine lets it
  const json end = replay(session);
  EXPECT_EQ(end["outcome"], "done") << end;
  expect_same(read_session(session), read_session(end["session"].get<std::string>()));
}

TEST_F(Replaying, ALateTickIsNoSilentDevice) {
  Session stalled = read_session(record(short_step, "max"));
  for (auto& [signal, series] : stalled.runs.at(0).signals) {
    for (double& t : series.t.edit()) {
      if (t > 0.5) t += 0.4;                    // the loop was away for so long
      if (signal != Signal::u_ref) t += 16e-6;  // and a card reads after the tick
    }
  }
  write_session(path("stalled.h5"), stalled);
  const json end = replay(path("stalled.h5"));
  EXPECT_EQ(end["outcome"], "done") << end;
  expect_same(read_session(path("stalled.h5")), read_session(end["session"].get<std::string>()));
}

TEST_F(Replaying, TakesAsLongAsTheRunDidUnlessHurried) {
  const std::string session = record(short_step, "max");
  for (const auto& [pace, least, most] : {std::tuple{"1", 1.19, 30.0}, {"10", 0.119, 1.0}}) {
    const auto start = std::chrono::steady_clock::now();
    const json end = replay(session, pace);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
    EXPECT_EQ(end["outcome"], "done") << end;
    EXPECT_GE(took.count(), least);
    EXPECT_LE(took.count(), most + 10) << "with the start of a daemon on a busy machine";
    expect_same(read_session(session), read_session(end["session"].get<std::string>()));
  }
}

TEST_F(Replaying, TakesACsvAsWell) {
  const std::string session = record(short_step, "max");
  const auto csv = path("export.csv");
  write_session(csv, read_session(session));
  const json end = replay(csv);
  EXPECT_EQ(end["outcome"], "done") << end;
  const Session original = read_session(csv);
  const Session replayed = read_session(end["session"].get<std::string>());
  for (const auto& [signal, series] : original.runs.at(0).signals) {
    EXPECT_EQ(replayed.runs.at(0).at(signal).t, series.t) << info(signal).name;
    EXPECT_EQ(replayed.runs.at(0).at(signal).value, series.value) << info(signal).name;
  }
}

TEST_F(Replaying, ASessionThatShowsAFaultRaisesItAtThatTime) {
  const std::string healthy = record(up_and_down, "max");
  const auto rows_after = [](const Series& series, double t) {
    return static_cast<std::size_t>(std::ranges::lower_bound(series.t, t) - series.t.begin());
  };
  struct Case {
    Fault fault;
    Signal signal;
    std::function<void(Series&)> change;
    double earliest, latest;  // [s]
  };
  const std::vector<Case> cases{
      {Fault::over_speed, Signal::omega, [&](Series& s) { s.value.edit()[rows_after(s, 1.7)] = 999; }, 1.699, 1.702},
      {Fault::over_current, Signal::i_a, [&](Series& s) { s.value.edit()[rows_after(s, 2)] = 99; }, 2.0, 2.6},
      {Fault::stale_signal, Signal::omega,
       [&](Series& s) {
         const auto from = static_cast<std::ptrdiff_t>(rows_after(s, 2)),
                    to = static_cast<std::ptrdiff_t>(rows_after(s, 3));
         s.t.erase(s.t.begin() + from, s.t.begin() + to);
         s.value.erase(s.value.begin() + from, s.value.begin() + to);
       },
       2.24, 2.27},
      {Fault::dead_tacho, Signal::omega,
       [&](Series& s) { std::ranges::fill(s.value.edit().subspan(rows_after(s, 1.5)), 0.0); }, 2.5, 3.8},
      {Fault::reversed_tacho, Signal::omega,
       [&](Series& s) {
         for (double& v : s.value.edit()) v = -v;
       },
       1.5, 3.8},
  };
  for (const Case& one : cases) {
    const json end =
        replay(edited(healthy, std::to_string(static_cast<int>(one.fault)) + ".h5", one.signal, one.change));
    ASSERT_EQ(end["outcome"], "fault") << text(one.fault);
    EXPECT_EQ(end["fault"]["code"], static_cast<int>(one.fault)) << end;
    EXPECT_GE(end["t"], one.earliest) << end;
    EXPECT_LE(end["t"], one.latest) << end;
    const Session session = read_session(end["session"].get<std::string>());
    EXPECT_EQ(session.runs.at(0).at(Signal::u_ref).value.back(), 0) << "it went safe";
  }
}

TEST_F(Replaying, ASessionThatWasCutOffIsReplayedToItsLastSample) {
  Session cut = read_session(record(short_step, "max"));
  cut.complete = false;
  for (auto& [signal, series] : cut.runs.at(0).signals) {
    const auto size = static_cast<std::size_t>(std::ranges::lower_bound(series.t, 0.7) - series.t.begin());
    series.t.resize(size);
    series.value.resize(size);
  }
  write_session(path("cut.h5"), cut);
  const json end = replay(path("cut.h5"));
  EXPECT_EQ(end["outcome"], "done") << end;
  Session replayed = read_session(end["session"].get<std::string>());
  Series& u = replayed.runs.at(0).signals.at(Signal::u_ref);
  EXPECT_EQ(u.value.back(), 0);
  u.t.pop_back();  // the one that makes safe
  u.value.pop_back();
  for (const auto& [signal, series] : cut.runs.at(0).signals) {
    if (series.t.empty()) continue;
    EXPECT_EQ(replayed.runs.at(0).at(signal).t, series.t) << info(signal).name;
    EXPECT_EQ(replayed.runs.at(0).at(signal).value, series.value) << info(signal).name;
  }
}

TEST_F(Replaying, RunsTwiceOnOneDaemonAndRefusesAnotherProfileInOneLine) {
  const std::string session = record(short_step, "max");
  Process emtbd(words({"--replay", session, "--pace", "max"}), path("twice"));
  const auto daemon = client_of(emtbd, path("s"));
  ASSERT_TRUE(daemon) << emtbd.err();
  daemon->call("reset", {});
  EXPECT_THAT(message_of<rpc::Refusal>([&] {
                daemon->call("run", {{"profile", up_and_down}});
              }),
              HasSubstr("this daemon replays " + session));
  for (int i = 0; i < 2; ++i) {
    const json started = daemon->call("run", {{"profile", "replay"}});
    ASSERT_TRUE(eventually([&] { return daemon->call("status", {})["run"].is_null(); }));
    expect_same(read_session(session), read_session(started["session"].get<std::string>()));
  }
  EXPECT_EQ(daemon->call("status", {})["state"], "armed");
}

TEST_F(Replaying, WhatCannotBeReplayedIsRefusedInOneLine) {
  const auto refused = [&](const std::string& session) {
    Process emtbd(words({"--replay", session}), path("refused"));
    EXPECT_EQ(emtbd.wait(), 2);
    EXPECT_EQ(std::ranges::count(emtbd.err(), '\n'), 1) << emtbd.err();
    return emtbd.err();
  };
  EXPECT_THAT(refused(path("none.h5")), HasSubstr("none.h5"));
  EXPECT_THAT(refused(write("two.csv", "run,t_s,omega_rad_s\na,0,1\na,1,1\nb,0,1\nb,1,1\n")), HasSubstr("two.csv"));
  EXPECT_THAT(refused(write("nan.csv", "t_s,omega_rad_s\n0,0\n1,nan\n")), HasSubstr("nan.csv:3"));
  EXPECT_THAT(refused(write("u.csv", "t_s,u_ref_V\n0,0\n1,1\n2,0\n")), HasSubstr("the reference alone"));
}

}  // namespace
}  // namespace emtb
