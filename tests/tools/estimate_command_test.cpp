#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "paper/bench.h"
#include "session/spec.h"
#include "tests/blind/recording.h"
#include "tests/tools/command_caller.h"

namespace emtb {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;

/// `emtb paper` and `emtb estimate`, as a person calls them.
class EstimateCommand : public CommandCaller {
 protected:
  /// A run as a session in a file.
  std::string session(const Run& run) {
    Session one;
    one.runs.push_back(run);
    const std::string file = path(run.name + ".csv");
    write_session(file, one);
    return file;
  }

  /// The estimate by this method in the JSON of the last call.
  static json by(const json& all, const std::string& method) {
    for (const json& e : all["estimates"]) {
      if (e["method"] == method) return e;
    }
    return {};
  }

  const simulated::Setup bench = paper::fh2();
};

TEST_F(EstimateCommand, ReadsThePapersNumbersOutOfItsExperiments) {
  const std::string out = path("e.json");
  ASSERT_EQ(call({"estimate", session(paper::raise_voltage(bench)), session(paper::open_armature(bench)), "--json", out,
                  "--svg", path("svg")}),
            0)
      << last->err();
  EXPECT_THAT(last->out(), AllOf(HasSubstr("R_a"), HasSubstr("left out"), HasSubstr("equation_6.svg")));
  const json all = json::parse(read(out));
  const json figure_4 = by(all, "equation_6");
  EXPECT_NEAR(figure_4["parameters"]["R_a"]["value"].get<double>(), 31.825, 0.4);
  EXPECT_GT(figure_4["parameters"]["R_a"]["std_error"].get<double>(), 0);
  EXPECT_EQ(figure_4["parameters"]["K_b"]["unit"], "V s/rad");
  EXPECT_GE(figure_4["points"].get<int>(), 12);
  EXPECT_GT(figure_4["used"][0]["to"], figure_4["used"][0]["from"]);
  EXPECT_TRUE(figure_4["lacking"].is_null());
  EXPECT_NEAR(by(all, "generator")["parameters"]["K_b"]["value"].get<double>(), 0.6739, 0.002);
  EXPECT_NEAR(by(all, "friction")["parameters"]["T_c"]["value"].get<double>(), 0.0547, 0.002);
  EXPECT_NEAR(by(all, "coast_down")["parameters"]["J"]["value"].get<double>(), 3.449e-3, 1.5e-4);
  EXPECT_NEAR(by(all, "acceleration")["parameters"]["J"]["value"].get<double>(), 3.449e-3, 5e-5);
  EXPECT_NEAR(by(all, "driver_gain")["parameters"]["gain"]["value"].get<double>(), 18.333, 0.01);
  EXPECT_THAT(by(all, "load_line")["lacking"].get<std::string>(), HasSubstr("Set the brake"));
  for (const char* method : {"equation_6", "friction", "generator", "coast_down", "acceleration", "driver_slopes"}) {
    EXPECT_THAT(read(path("svg") / (std::string(method) + ".svg")), HasSubstr("<svg")) << method;
  }
}

TEST_F(EstimateCommand, ThePaperCommandWritesAPageItsPicturesAndItsSessions) {
  ASSERT_EQ(call({"paper", "--out", path("docs"), "--sessions", path("sessions")}), 0) << last->err();
  EXPECT_EQ(last->err(), "") << "no progress bar into a pipe";
  EXPECT_THAT(read(path("docs") / "paper.md"), HasSubstr("pictures/paper/figure_11.svg"));
  EXPECT_THAT(read(path("docs") / "pictures/paper/figure_11.svg"), HasSubstr("<svg"));
  ASSERT_EQ(call({"estimate", path("sessions") / "lower_voltage.csv", "--what", "friction"}), 0) << last->err();
  EXPECT_THAT(last->out(), HasSubstr("the brake's"));
}

TEST_F(EstimateCommand, AResistanceThatIsNegativeIsDoubted) {
  Run run = paper::raise_voltage(bench);
  for (double& i : run.signals.at(Signal::i_a).value.edit()) i = -i;
  ASSERT_EQ(call({"estimate", session(run), "--what", "resistance"}), 0) << last->err();
  EXPECT_THAT(last->out(), AllOf(HasSubstr("R_a is negative"), HasSubstr("wrong sign"), HasSubstr("scale: -1")));
}

TEST_F(EstimateCommand, AnAnalysisThatRefusesSaysWhyAndStillDraws) {
  EXPECT_EQ(call({"estimate", session(paper::step_up(bench)), "--what", "inertia", "--svg", path("svg")}), 1);
  EXPECT_THAT(last->out(), AllOf(HasSubstr("no result"), HasSubstr("22.5 V/s"), HasSubstr("contactor")));
  EXPECT_THAT(read(path("svg") / "switch_on.svg"), HasSubstr("<svg"));
}

TEST_F(EstimateCommand, TakesTheStretchesThatItIsGiven) {
  const std::string out = path("e.json");
  ASSERT_EQ(call({"estimate", session(paper::raise_voltage(bench)), "--what", "resistance", "--settled", "3:5", "18:20",
                  "58:60", "--json", out}),
            0)
      << last->err();
  const json e = by(json::parse(read(out)), "armature");
  EXPECT_EQ(e["points"], 3);
  EXPECT_EQ(e["used"][1]["from"], 18);
}

TEST_F(EstimateCommand, WithAModelItIsInverseDynamicsAndAFitOfTheWholeRun) {
  const blind::Bench servo = blind::fast_bench();
  const std::string run = session(record(servo, servo.train[3], 1));
  const std::string model = std::filesystem::path(EMTB_CONFIG) / "models/desk.yaml", out = path("e.json");
  ASSERT_EQ(call({"estimate", run, "--model", model, "--json", out}), 0) << last->err();
  EXPECT_TRUE(json::parse(read(out))["parameters"].contains("T_L")) << "as ever";
  ASSERT_EQ(call({"estimate", run, "--model", model, "--what", "inertia", "inverse-dynamics", "--json", out}), 0)
      << last->err();
  const json all = json::parse(read(out));
  EXPECT_NEAR(by(all, "whole_run")["parameters"]["J"]["value"].get<double>(), servo.plant.motor.J, 3e-6);
  EXPECT_TRUE(by(all, "inverse_dynamics")["parameters"].contains("J"));
}

TEST_F(EstimateCommand, RefusesBadUseInOneLine) {
  const std::string run = session(paper::step_up(bench));
  const auto refuses = [&](const std::vector<std::string>& words, const testing::Matcher<const std::string&>& message) {
    EXPECT_EQ(call(words), 2) << last->out();
    EXPECT_EQ(std::ranges::count(last->err(), '\n'), 1) << last->err();
    EXPECT_THAT(last->err(), message);
  };
  refuses({"estimate", run, "--what", "magic"}, AllOf(HasSubstr("magic"), HasSubstr("torque-constant")));
  refuses({"estimate", run, "--settled", "5-9"}, AllOf(HasSubstr("5-9"), HasSubstr("T0:T1")));
  refuses({"estimate", run, "--settled", "50:90"}, HasSubstr("50:90"));
  refuses({"estimate", run, "--what", "inverse-dynamics"}, HasSubstr("--model"));
  refuses({"paper", "--out", run}, HasSubstr("--out"));
}

}  // namespace
}  // namespace emtb
