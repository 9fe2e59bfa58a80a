#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "session/spec.h"
#include "tests/analysis/check/planted.h"
#include "tests/blind/recording.h"
#include "tests/tools/command_caller.h"

namespace emtb {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

/// `emtb check` on files, and the commands that look first.
class CheckCommand : public CommandCaller {
 protected:
  std::string write_run(const std::string& name, const emtb::Run& run) {
    Session session;
    session.runs.push_back(run);
    const std::string file = path(name);
    write_session(file, session);
    return file;
  }

  emtb::Run good(std::uint64_t seed = 1) const {
    const blind::Bench bench = blind::slow_bench();
    return record(bench, bench.train[1], seed);
  }

  json findings(const std::string& file) const { return json::parse(read(file)).at("findings"); }
  std::string model() const { return (std::filesystem::path(EMTB_CONFIG) / "models/fh2.yaml").string(); }
};

TEST_F(CheckCommand, GoodRecordingsPass) {
  const std::string file = write_run("good.h5", good());
  EXPECT_EQ(call({"check", file, "--model", model(), "--json", path("found.json")}), 0) << last->out() << last->err();
  EXPECT_EQ(last->out(), "nothing is wrong with 1 run\n");
  EXPECT_TRUE(findings(path("found.json")).empty());
}

TEST_F(CheckCommand, SaysWhatIsWrongWhereAndEndsWithOne) {
  emtb::Run run = good();
  planted::scale(run, Signal::e_a, -1);
  const std::string turned = write_run("turned.csv", run);
  EXPECT_EQ(call({"check", turned, "--json", path("found.json")}), 1);
  EXPECT_THAT(last->out(), AllOf(HasSubstr("turned.csv: sign: e_a"), HasSubstr("scale: -1")));
  const json found = findings(path("found.json"));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0]["session"], turned);
  EXPECT_EQ(found[0]["run"], "");
  EXPECT_EQ(found[0]["signal"], "e_a");
  EXPECT_EQ(found[0]["what"], "sign");
  EXPECT_EQ(found[0]["stops"], true);
  EXPECT_EQ(found[0]["from_s"], 0);
  EXPECT_GT(found[0]["to_s"].get<double>(), 1);
  EXPECT_FALSE(found[0]["text"].get<std::string>().empty());
}

TEST_F(CheckCommand, ARunThatJudgesMustNotBeFitted) {
  const std::string file = write_run("a.csv", good()), copy = write_run("b.csv", good());
  const std::string other = write_run("c.csv", good(2));
  EXPECT_EQ(call({"check", file, other, "--model", model()}), 0) << last->out();
  EXPECT_EQ(call({"check", file, "--held-out", copy}), 1);
  EXPECT_THAT(last->out(), HasSubstr("b.csv: duplicate: holds readings of " + file));
  EXPECT_EQ(call({"check", file, file}), 1);
  EXPECT_THAT(last->out(), HasSubstr("is listed twice"));
}

TEST_F(CheckCommand, NothingIsFittedToRecordingsThatContradictThemselves) {
  emtb::Run run = good();
  for (auto& v : run.signals.at(Signal::omega).value.edit()) v *= -1;
  const std::string file = write_run("turned.csv", run);
  for (const std::string command : {"diagnose", "calibrate", "report"}) {
    EXPECT_EQ(call({command, model(), file, "--out", path("out")}), 1) << command;
    EXPECT_THAT(last->out(), AllOf(HasSubstr("sign: omega"), HasSubstr("these recordings contradict themselves. Mend "
                                                                       "them, or add --unchecked")))
        << command;
    EXPECT_FALSE(std::filesystem::exists(path("out"))) << command;
  }
  EXPECT_EQ(call({"diagnose", model(), file, "--json", "-"}), 1);
  EXPECT_EQ(last->out(), "") << "JSON is all that stands on standard output";
  EXPECT_THAT(last->err(), HasSubstr("sign: omega"));
  call({"calibrate", model(), file, "--unchecked"});
  EXPECT_THAT(last->out(), AllOf(HasSubstr("std error"), Not(HasSubstr("sign: omega"))));
}

TEST_F(CheckCommand, WhereTheModelsBoundsSayItTheyMayBeWhatIsWrong) {
  emtb::Run run = good();
  planted::scale(run, Signal::omega, 9.5493);
  const std::string file = write_run("rpm.csv", run);
  EXPECT_EQ(call({"calibrate", model(), file}), 1);
  EXPECT_THAT(last->out(), AllOf(HasSubstr("scale: "), HasSubstr("the model allows"), Not(HasSubstr("themselves")),
                                 HasSubstr("Nothing was fitted: these recordings contradict the model's bounds. Mend "
                                           "them, or widen the bounds in the model's file, or add --unchecked\n")));
}

TEST_F(CheckCommand, AGapIsTwoRunsAndNotAHundredSecondsOfMotion) {
  const emtb::Run whole = good();
  emtb::Run holed = whole;
  planted::pause(holed, 0.75 * whole.duration(), 100);
  const auto error_of = [&](const std::string& file) {
    EXPECT_EQ(call({"calibrate", model(), file, "--json", path("fit.json")}), 0) << last->err();
    return json::parse(read(path("fit.json")))["error"]["train"].get<double>();
  };
  const double without = error_of(write_run("whole.csv", whole));
  const double with = error_of(write_run("holed.csv", holed));
  EXPECT_THAT(last->out(), HasSubstr("gap: the file has no reading for 100 s"));
  EXPECT_LT(with, 2 * without)
      << "the second piece begins where its first readings tell, a driver on its slope no better";
}

TEST_F(CheckCommand, ResolutionAndWindowSurviveTheWayThroughCsv) {
  const std::string session = write_run("bench.h5", good());
  ASSERT_EQ(call({"export", session, "--out", path("bench.csv")}), 0);
  ASSERT_EQ(call({"info", session, "--json", path("h5.json")}), 0);
  ASSERT_EQ(call({"info", path("bench.csv"), "--json", path("csv.json")}), 0);
  const json before = json::parse(read(path("h5.json")))[0]["runs"][0]["signals"];
  const json after = json::parse(read(path("csv.json")))[0]["runs"][0]["signals"];
  for (const char* signal : {"i_a", "omega", "e_a"}) {
    EXPECT_GT(before[signal]["lsb"].get<double>(), 0) << signal;
    EXPECT_EQ(before[signal]["lsb"], after[signal]["lsb"]) << signal;
    EXPECT_EQ(before[signal]["window"], after[signal]["window"]) << signal;
  }
  EXPECT_GT(after["i_a"]["window"].get<double>(), 0);
}

TEST_F(CheckCommand, APauseOfAnHourTakesNoMemory) {
  emtb::Run run = good();
  planted::pause(run, 5, 3600);
  const std::string file = write_run("pause.csv", run);
  EXPECT_EQ(call({"check", file}), 0);
  EXPECT_THAT(last->out(), HasSubstr("taken as 2 pieces"));
  const std::string limited = "ulimit -v 1000000; exec " + std::string(EMTB) + " calibrate " + model() + " " + file;
  Process emtb({"/bin/sh", "-c", limited}, path("limited"));
  EXPECT_EQ(emtb.wait(60), 0) << emtb.err();
  EXPECT_THAT(emtb.out(), HasSubstr("error (1 = noise floor)"));
}

TEST_F(CheckCommand, APauseOfAHundredHoursIsNoSlowMeter) {
  emtb::Run run = good();
  planted::pause(run, 5, 360'000);
  EXPECT_EQ(call({"calibrate", model(), write_run("pause.csv", run)}), 0) << last->err();
  EXPECT_THAT(last->out() + last->err(), AllOf(HasSubstr("taken as 2 pieces"), Not(HasSubstr("time_unit"))));
}

TEST_F(CheckCommand, TimesInMillisecondsOfAFastRecordingTakeNoMemory) {
  std::string csv = "t_s,u_ref_V,omega_rad_s\n";  // at 1 kHz: half an hour, taken as seconds
  for (int k = 0; k < 2000; ++k) csv += std::to_string(k) + ",3," + std::to_string(50 + k % 7) + "\n";
  const std::string limited =
      "ulimit -v 1000000; exec " + std::string(EMTB) + " calibrate " + model() + " " + write("ms.csv", csv).string();
  Process emtb({"/bin/sh", "-c", limited}, path("limited"));
  EXPECT_EQ(emtb.wait(300), 0) << emtb.err();
}

TEST_F(CheckCommand, TimesInMillisecondsUnderSecondsAreSaid) {
  std::string csv = "t_s,u_ref_V,omega_rad_s\n";  // at 50 Hz
  for (int k = 0; k < 500; ++k) csv += std::to_string(20 * k) + ",3," + std::to_string(50 + k % 7) + "\n";
  EXPECT_EQ(call({"calibrate", model(), write("ms.csv", csv)}), 2);
  EXPECT_THAT(last->err(), HasSubstr("time_unit: ms"));
}

}  // namespace
}  // namespace emtb
