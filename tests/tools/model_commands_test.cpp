#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>

#include "model/catalogue.h"
#include "session/spec.h"
#include "tests/blind/recording.h"
#include "tests/tools/command_caller.h"

namespace emtb {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::MatchesRegex;
using testing::Not;
using testing::StartsWith;

/// `emtb` on files, as a person calls it.
class ModelCommands : public CommandCaller {
 protected:
  /// Bad use or input: exit 2, nothing on standard output, and one line that contains `words`.
  void refuses(const std::vector<std::string>& call_words, const testing::Matcher<const std::string&>& message) {
    EXPECT_EQ(call(call_words), 2) << last->out() << last->err();
    EXPECT_EQ(last->out(), "");
    const std::string line = last->err();
    EXPECT_EQ(std::ranges::count(line, '\n'), 1) << line;
    EXPECT_THAT(line, message);
  }

  std::string model() const { return (std::filesystem::path(EMTB_CONFIG) / "models/fh2.yaml").string(); }

  /// Short runs of the paper's bench with its friction, one CSV each.
  void record_with_friction() {
    blind::Bench bench = blind::slow_bench();
    bench.plant.friction.T_c = 0.0547;  // [N m]
    record_all(bench);
  }

  void record_all(const blind::Bench& bench) {
    std::uint64_t seed = 1;
    for (const auto* profiles : {&bench.train, &bench.held_out}) {
      for (const Profile& profile : *profiles) {
        Session session;
        session.runs.push_back(record(bench, profile, seed++));
        const std::string file = path(profile.name() + ".csv");
        write_session(file, session);
        (profiles == &bench.train ? train : held_out).push_back(file);
      }
    }
  }

  /// A friction that the library does not have, and one that is not there.
  std::string candidates() {
    return write("mine.yaml",
                 "my_cubic: {torque: \"-c3*omega^3\", parameters: {c3: {value: 0, min: 0, max: 1.0e-5, unit: N m "
                 "s3/rad3, null: 0}}}\n"
                 "sticky_field: {flux: \"1 - k*t\", parameters: {k: {value: 0, min: -0.1, max: 0.1, unit: 1/s}}}\n");
  }

  std::vector<std::string> with_sessions(std::vector<std::string> words) const {
    words.insert(words.end(), train.begin(), train.end());
    words.push_back("--held-out");
    words.insert(words.end(), held_out.begin(), held_out.end());
    return words;
  }

  static std::vector<std::string> tail(const std::string& text, std::size_t count) {
    std::vector<std::string> lines;
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    return {lines.end() - static_cast<std::ptrdiff_t>(std::min(count, lines.size())), lines.end()};
  }

  std::vector<std::string> train, held_out;
};

TEST_F(ModelCommands, DiagnoseWritesTheContractsJson) {
  record_with_friction();
  auto words = with_sessions({"diagnose", model()});
  words.insert(words.end(), {"--json", path("d.json")});
  ASSERT_EQ(call(words), 0) << last->err();
  EXPECT_THAT(last->out(), AllOf(HasSubstr("found:"), HasSubstr("coulomb_friction")));
  EXPECT_EQ(last->err(), "") << "no progress bar into a pipe";
  const json d = json::parse(read(path("d.json")));
  EXPECT_EQ(d["verdict"], "found");
  ASSERT_EQ(d["missing"].size(), 1U);
  EXPECT_EQ(d["missing"][0]["id"], "coulomb_friction");
  EXPECT_NEAR(d["missing"][0]["parameters"]["T_c"]["value"].get<double>(), 0.0547, 0.002);
  EXPECT_EQ(d["missing"][0]["parameters"]["T_c"]["unit"], "N m");
  EXPECT_GT(d["error"]["base"]["held_out"].get<double>(), 2);
  EXPECT_LT(d["error"]["final"]["held_out"].get<double>(), 1.1);
  EXPECT_EQ(d["unexplained"], d["error"]["final"]["held_out"]);
  EXPECT_EQ(d["candidates"].size(), effect_count) << "every absent effect, also those that explain nothing";
  for (const char* key : {"id", "predicted_drop", "visibility", "p_value", "held_out_error", "detectable_size"}) {
    EXPECT_TRUE(d["candidates"][0].contains(key)) << key;
  }
  EXPECT_EQ(d["candidates"][0]["id"], "coulomb_friction");
  for (const char* name : {"R_a", "K_b", "K_m", "B", "J"}) {
    for (const char* key : {"value", "std_error", "unit"})
      EXPECT_TRUE(d["parameters"][name].contains(key)) << name << key;
  }
  for (const char* key : {"sigma", "sigma_from", "rmse", "fit_percent"}) {
    EXPECT_TRUE(d["signals"]["omega"].contains(key)) << key;
  }
  EXPECT_TRUE(d["steps"][0]["added"].is_null()) << "the model as given";
  EXPECT_EQ(d["steps"][1]["added"], "coulomb_friction");
  EXPECT_LT(d["steps"][1]["held_out"].get<double>(), d["steps"][0]["held_out"].get<double>());
  for (const char* key : {"signal", "against", "bins", "rmse"}) EXPECT_TRUE(d["where"][0].contains(key)) << key;
  EXPECT_TRUE(d.contains("next_experiment"));
}

TEST_F(ModelCommands, DiagnoseEndsWithTheAnswerInFiveLinesAndTheNextCommandRuns) {
  record_with_friction();
  ASSERT_EQ(call(with_sessions({"diagnose", model()})), 0) << last->err();
  const std::string out = last->out();
  const std::vector<std::string> last_lines = tail(out, 6);
  EXPECT_EQ(last_lines[0], "") << "the answer stands apart";
  EXPECT_EQ(last_lines[1], "missing  coulomb_friction (Coulomb friction)");
  EXPECT_THAT(last_lines[2], MatchesRegex("size     T_c = 0\\.054[0-9]* \\+- .* N m"));
  EXPECT_THAT(last_lines[3], StartsWith("sure     found: "));
  EXPECT_THAT(last_lines[4], MatchesRegex("error    .* -> .* noise floors held out, .* -> .* in training"));
  EXPECT_THAT(out, AllOf(HasSubstr("5 of " + std::to_string(effect_count) + "; --all"),
                         HasSubstr("Candidates, best first"), Not(HasSubstr("e+02")), Not(HasSubstr("e+09"))));
  ASSERT_THAT(last_lines[5], StartsWith("next     emtb add coulomb_friction "));
  std::istringstream words(last_lines[5].substr(std::string("next     emtb ").size()));
  std::vector<std::string> next{std::istream_iterator<std::string>(words), {}};
  next.back() = path(next.back());  // as if typed in that folder
  ASSERT_EQ(call(next), 0) << last->err();
  EXPECT_TRUE(std::filesystem::exists(path("fh2-with-coulomb_friction.yaml")));
}

TEST_F(ModelCommands, AddWritesAModelWithItsHistoryAndLeavesTheGivenOneAlone) {
  record_with_friction();
  const std::string given = write("given.yaml", read(model()));
  auto words = with_sessions({"add", "coulomb_friction", given});
  words.insert(words.end(), {"--out", path("with.yaml"), "--json", path("a.json")});
  ASSERT_EQ(call(words), 0) << last->err();
  EXPECT_EQ(read(given), read(model()));
  const std::string added = read(path("with.yaml"));
  EXPECT_THAT(added, AllOf(HasSubstr("coulomb_friction"), HasSubstr("added coulomb_friction"), HasSubstr("held_out")));
  const json a = json::parse(read(path("a.json")));
  EXPECT_GT(a["before"]["held_out"].get<double>(), 2 * a["error"]["held_out"].get<double>());
  // What was written can be read, compared, and is at the floor.
  std::vector<std::string> compare{"compare", path("with.yaml"), "--json", path("c.json")};
  compare.insert(compare.end(), held_out.begin(), held_out.end());
  ASSERT_EQ(call(compare), 0) << last->err();
  EXPECT_LT(json::parse(read(path("c.json")))["error"]["staged"].get<double>(), 1.1);

  // Two models side by side, weighed alike.
  compare.insert(compare.begin() + 2, given);
  compare.insert(compare.end(), "--fit");
  ASSERT_EQ(call(compare), 0) << last->err();
  EXPECT_THAT(last->out(),
              AllOf(HasSubstr("2 models"), HasSubstr("nearest to the measurements: " + path("with.yaml").string())));
  const json both = json::parse(read(path("c.json")))["models"];
  ASSERT_EQ(both.size(), 2U);
  EXPECT_EQ(both[0]["signals"]["omega"]["sigma"], both[1]["signals"]["omega"]["sigma"]);
  EXPECT_LT(2 * both[0]["error"]["staged"].get<double>(), both[1]["error"]["staged"].get<double>());
}

/// Where the formula is hardly anything in training, and infinite in the run that judges.
TEST_F(ModelCommands, AHeldOutRunThatBlowsUpIsSaidAndNeverWrittenAsANumber) {
  blind::Bench bench = blind::slow_bench();
  bench.train = {step("slow", 1, 0.5, 4, 2), step("slower", 0.8, 0.5, 4, 2)};
  bench.held_out = {step("fast", 5, 0.5, 6, 2)};
  record_all(bench);
  const std::string cliff = write("cliff.yaml",
                                  "cliff: {torque: \"c*exp(exp(omega/15))\", parameters: {c: {value: 1.0e-12, min: "
                                  "1.0e-12, max: 1, unit: N m, null: 1.0e-12}}}\n");
  auto words = with_sessions({"add", "cliff", model(), "--candidates", cliff});
  words.insert(words.end(), {"--out", path("with.yaml"), "--json", path("a.json")});
  EXPECT_EQ(call(words), 1);
  EXPECT_THAT(last->out(), HasSubstr("held-out -\n"));
  EXPECT_THAT(last->err(), HasSubstr("the simulation of a held-out run leaves all bounds"));
  EXPECT_TRUE(json::parse(read(path("a.json")))["error"]["held_out"].is_null());
  EXPECT_THAT(read(path("with.yaml")), Not(testing::AnyOf(HasSubstr("nan"), HasSubstr("inf"), HasSubstr("held_out"))));

  EXPECT_EQ(call({"compare", path("with.yaml"), train[0]}), 0) << "emtb reads its own file: " << last->err();
  refuses(with_sessions({"diagnose", path("with.yaml")}), HasSubstr("leaves all bounds on a held-out run"));
  EXPECT_EQ(call({"compare", path("with.yaml"), held_out[0]}), 1);
  EXPECT_THAT(last->out(), Not(HasSubstr("the instrument explains all of it; -")));
}

TEST_F(ModelCommands, IntervalsSayHowLargeAFrictionMayBeThatTheLinearModelHasSmall) {
  record_all(blind::slow_bench());
  auto words = with_sessions({"add", "windage", model()});
  words.insert(words.end(), {"--intervals", "--json", path("a.json")});
  EXPECT_EQ(call(words), 0) << last->err();
  EXPECT_THAT(last->out(), HasSubstr("95 % by profile likelihood"));
  const json parameters = json::parse(read(path("a.json")))["parameters"];
  for (const char* name : {"R_a", "K_b", "J", "windage.c_w"}) {
    const json& one = parameters[name];
    EXPECT_LE(one["interval95"]["low"].get<double>(), one["value"].get<double>()) << name;
    EXPECT_GT(one["interval95"]["high"].get<double>(), one["value"].get<double>()) << name;
  }
  EXPECT_EQ(parameters["windage.c_w"]["interval95"]["low"], 0) << "none is there";
  EXPECT_TRUE(parameters["windage.c_w"]["interval95"]["low_at_bound"].get<bool>());
  EXPECT_FALSE(parameters["windage.c_w"]["interval95"]["high_at_bound"].get<bool>());
}

TEST_F(ModelCommands, AddSaysWhereAnEffectFitsWithValuesThatNoMachineHas) {
  record_with_friction();
  auto words = with_sessions({"add", "field_heating", model()});
  words.insert(words.end(), {"--json", path("a.json")});
  call(words);
  EXPECT_THAT(last->err(), HasSubstr("emtb: field_heating: tau is "));
  EXPECT_THAT(last->err(), HasSubstr("no winding warms up faster. What these runs show is hardly this effect\n"));
  EXPECT_EQ(json::parse(read(path("a.json")))["implausible"].size(), 1U);

  words = with_sessions({"add", "coulomb_friction", model()});
  words.insert(words.end(), {"--json", path("a.json")});
  EXPECT_EQ(call(words), 0);
  EXPECT_EQ(last->err(), "");
  EXPECT_TRUE(json::parse(read(path("a.json")))["implausible"].empty());
}

TEST_F(ModelCommands, DiagnoseNamesAFormulaOfTheUserAndAddAddsIt) {
  constexpr double c3 = 3e-8;  // [N m s3/rad3]
  blind::Bench bench = blind::slow_bench();
  bench.plant.hidden_torque = [](double omega, double, double) { return c3 * omega * omega * omega; };
  record_all(bench);
  auto words = with_sessions({"diagnose", model()});
  words.insert(words.end(), {"--json", path("d.json"), "--candidates", candidates(), "--out", path("found.yaml")});
  ASSERT_EQ(call(words), 0) << last->err();
  EXPECT_THAT(last->out(), AllOf(HasSubstr("found:"), HasSubstr("my_cubic (T = -c3*omega^3)")));
  const json d = json::parse(read(path("d.json")));
  EXPECT_EQ(d["verdict"], "found");
  ASSERT_EQ(d["missing"].size(), 1U) << last->out();
  EXPECT_EQ(d["missing"][0]["id"], "my_cubic");
  EXPECT_NEAR(d["missing"][0]["parameters"]["c3"]["value"].get<double>(), c3, 0.03 * c3);
  EXPECT_EQ(d["missing"][0]["parameters"]["c3"]["unit"], "N m s3/rad3");
  EXPECT_EQ(d["candidates"].size(), effect_count + 2) << "the library's effects and both formulas";
  EXPECT_EQ(d["candidates"][0]["id"], "my_cubic");
  EXPECT_TRUE(d["candidates"][0]["expected"].contains("c3"));
  EXPECT_EQ(d["steps"][1]["added"], "my_cubic");
  EXPECT_TRUE(d["parameters"].contains("my_cubic.c3"));
  EXPECT_LT(d["error"]["final"]["held_out"].get<double>(), 1.1);

  words = with_sessions({"add", "my_cubic", model()});
  words.insert(words.end(), {"--candidates", candidates(), "--out", path("with.yaml")});
  ASSERT_EQ(call(words), 0) << last->err();
  EXPECT_THAT(last->out(), HasSubstr("my_cubic.c3"));
  EXPECT_THAT(read(path("with.yaml")), AllOf(HasSubstr("my_cubic:"), HasSubstr("torque: \"-c3*omega^3\"")));

  // With it, nothing is missing, whether it is on offer or not.
  words = with_sessions({"diagnose", path("with.yaml")});
  words.insert(words.end(), {"--json", path("w.json"), "--candidates", candidates()});
  ASSERT_EQ(call(words), 0) << last->err();
  const json w = json::parse(read(path("w.json")));
  EXPECT_EQ(w["verdict"], "nothing_missing") << last->out();
  EXPECT_EQ(w["candidates"].size(), effect_count + 1) << "what is in the model is no candidate";
}

TEST_F(ModelCommands, SimulateAndExportMakeSessionsThatCanBeRead) {
  ASSERT_EQ(call({"simulate", model(), "fh2_step_low", "--out", path("s.csv")}), 0) << last->err();
  ASSERT_EQ(call({"export", path("s.csv").string() + "@1:4", "--out", path("s.h5")}), 0) << last->err();
  ASSERT_EQ(call({"info", path("s.h5"), "--json", path("i.json")}), 0) << last->err();
  const json i = json::parse(read(path("i.json")));
  EXPECT_EQ(i[0]["runs"][0]["signals"]["omega"]["readings"], 3000) << "a span ends before its second time";
}

TEST_F(ModelCommands, RefuseBadInputInOneLine) {
  const std::string good = write("good.csv", "t_s,u_ref_V,omega_rad_s\n0,0,0\n0.1,0,0\n0.2,0,0\n");
  refuses({"compare", model(), model()}, HasSubstr("needs a SESSION"));
  refuses({"compare", model(), path("absent.csv")}, HasSubstr("absent.csv"));
  refuses({"compare", model(), write("text.csv", "t_s,u_ref_V,omega_rad_s\n0,0,0\n1,zero,0\n")},
          HasSubstr("text.csv:3"));
  refuses({"compare", model(), write("nan.csv", "t_s,u_ref_V,omega_rad_s\n0,0,0\n1,0,nan\n")}, HasSubstr("nan.csv:3"));
  refuses({"compare", model(), write("unsorted.csv", "t_s,u_ref_V,omega_rad_s\n0,0,0\n1,0,0\n0.5,0,0\n")},
          HasSubstr("unsorted.csv:4"));
  refuses({"compare", model(), write("no_time.csv", "u_ref_V,omega_rad_s\n0,0\n")}, HasSubstr("t_s"));
  refuses({"compare", model(), write("short.csv", "t_s,u_ref_V,omega_rad_s\n0,0,0\n")}, HasSubstr("too short"));
  std::string long_enough = "t_s,omega_rad_s\n";
  for (int k = 0; k < 50; ++k) long_enough += std::to_string(0.1 * k) + ",0\n";
  refuses({"compare", model(), write("no_input.csv", long_enough)},
          AllOf(HasSubstr("no_input.csv"), HasSubstr("u_ref_V")));
  refuses({"compare", model(), write("broken.h5", "not HDF5 at all")}, HasSubstr("broken.h5"));
  refuses({"add", "gremlins", model(), good}, AllOf(HasSubstr("gremlins"), HasSubstr("coulomb_friction")));
  refuses({"add", "gremlins", model(), good, "--candidates", candidates()},
          AllOf(HasSubstr("gremlins"), HasSubstr("coulomb_friction"), HasSubstr("my_cubic")));
  refuses({"diagnose", model(), good, "--candidates", write("bad.yaml", "bad: {torque: \"-c*speed\"}\n")},
          AllOf(HasSubstr("bad.yaml:1: bad.torque"), HasSubstr("`c` at column 2")));
  refuses({"diagnose", model(), good, "--candidates", path("absent.yaml")}, HasSubstr("absent.yaml"));
  const std::string text = read(model());
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string copy = text;
    const auto at = copy.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return write("changed.yaml", copy.replace(at, from.size(), to));
  };
  refuses({"compare", changed("value: 30,", "value: 300,"), good},
          AllOf(HasSubstr("changed.yaml:"), HasSubstr("R_a"), HasSubstr("outside")));
  refuses({"compare", changed("effects: {}", "effects: {gremlins: {}}"), good},
          AllOf(HasSubstr("changed.yaml:"), HasSubstr("gremlins")));
  refuses({"compare", changed("  B:", "  Bee:"), good}, AllOf(HasSubstr("changed.yaml:"), HasSubstr("Bee")));
  refuses({"compare", changed("unit: ohm", "unit: kohm"), good}, HasSubstr("kohm"));
  refuses({"compare", changed("input: u_ref", "input: omega"), good}, HasSubstr("omega"));
  refuses({"compare", changed("tie: {K_m: K_b}", "tie: {K_m: K_x}"), good}, HasSubstr("K_x"));
  refuses({"compare", write("tabs.yaml", "name:\n\t- x\n"), good}, HasSubstr("tabs.yaml:"));
  refuses({"compare", path("absent.yaml"), good}, HasSubstr("absent.yaml"));
  refuses({"frobnicate"}, HasSubstr("emtb --help"));
  refuses({"compare", model()}, HasSubstr("SESSION"));
}

}  // namespace
}  // namespace emtb
