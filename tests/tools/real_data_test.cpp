// What the pages in docs/data say of real machines: limits on both sides of what was found when they were written.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/outside_data.h"
#include "tests/process.h"
#include "tests/session/scratch.h"

namespace emtb {
namespace {

using json = nlohmann::json;
using testing::AnyOf;
using testing::Contains;
using testing::ElementsAre;
using testing::UnorderedElementsAre;

class RealData : public Scratch {
 protected:
  void SetUp() override {
    if (const std::string none = no_outside_data(); !none.empty()) GTEST_SKIP() << none;
  }

  json diagnosed(const std::string& model, const std::string& file, const std::vector<std::string>& train,
                 const std::vector<std::string>& held_out) {
    const std::string data = (outside_data() / file).string(), config = EMTB_CONFIG;
    std::vector<std::string> words{EMTB, "diagnose", config + "/models/" + model + ".yaml"};
    for (const std::string& run : train) words.push_back(data + run);
    words.emplace_back("--held-out");
    for (const std::string& run : held_out) words.push_back(data + run);
    words.insert(words.end(), {"--map", config + "/mappings/" + model + ".yaml", "--out", path("final.yaml").string()});
    return answer_to(words);
  }

  /// What a law could say of what the last diagnosis left.
  json discovered(const std::string& mapping, const std::string& train, const std::string& held_out) {
    const std::string data = outside_data().string() + "/", config = EMTB_CONFIG;
    return answer_to({EMTB, "discover", path("final.yaml").string(), data + train, "--held-out", data + held_out,
                      "--map", config + "/mappings/" + mapping + ".yaml"});
  }

  json answer_to(std::vector<std::string> words) {
    words.insert(words.end(), {"--json", path("d.json").string()});
    Process emtb(words, path("emtb"));
    EXPECT_EQ(emtb.wait(800), 0) << emtb.err();
    return json::parse(read(path("d.json")));
  }

  static std::vector<std::string> names(const json& d) {
    std::vector<std::string> list;
    for (const json& m : d["missing"]) list.push_back(m["id"]);
    return list;
  }
  static double value(const json& d, const std::string& effect, const std::string& parameter) {
    for (const json& m : d["missing"]) {
      if (m["id"] == effect) return m["parameters"][parameter]["value"];
    }
    return std::nan("");
  }
};

TEST_F(RealData, IntecoHidesFrictionAVoltageAndTheRippleOfItsTacho) {
  const json d = diagnosed("inteco", "inteco_servo/inteco_servo.csv", {"#steps_up", "#coast_pos"}, {"#coast_neg"});
  EXPECT_EQ(d["verdict"], "unknown_effect");
  EXPECT_THAT(names(d), UnorderedElementsAre("coulomb_friction", "brush_drop", "tacho_ripple"));
  EXPECT_NEAR(value(d, "coulomb_friction", "T_c"), 0.009, 0.001);
  // The authors' dead band of 0.95 V, less what the friction makes of it.
  const double by_friction = value(d, "coulomb_friction", "T_c") * d["parameters"]["R_a"]["value"].get<double>() /
                             d["parameters"]["K_m"]["value"].get<double>();
  EXPECT_NEAR(value(d, "brush_drop", "V_b"), 0.95 - by_friction, 0.09);
  EXPECT_NEAR(value(d, "tacho_ripple", "r"), 0.058, 0.002);
  EXPECT_NEAR(value(d, "tacho_ripple", "N"), 6, 0.002);
  EXPECT_NEAR(d["parameters"]["J"]["value"], 1.118e-3, 0.08e-3);  // the authors'
  EXPECT_NEAR(d["error"]["base"]["held_out"], 51, 5);
  EXPECT_NEAR(d["error"]["final"]["held_out"], 9.4, 1);
}

TEST_F(RealData, Jga25HidesFrictionOrADeadZoneAndALag) {
  std::vector<std::string> train, held_out;  // one in eight: the rest says the same, and takes its time
  for (int run = 0; run < 104; run += 4) {
    char name[8];
    std::snprintf(name, sizeof name, "#s%03d", run);
    (run % 8 == 0 ? train : held_out).emplace_back(name);
  }
  const json d = diagnosed("jga25", "jga25_steps/jga25_steps.csv", train, held_out);
  EXPECT_EQ(d["verdict"], "unknown_effect");
  // Either of the two that do the same stands for both.
  EXPECT_THAT(names(d), UnorderedElementsAre(AnyOf("driver_dead_zone", "coulomb_friction"), "driver_saturation"));
  // The authors: above 90 % of 12 V. What is dead counts to it.
  const bool is_dead = d["missing"][0]["id"] == "driver_dead_zone";
  EXPECT_THAT(d["missing"][0]["tied_with"], Contains(is_dead ? "coulomb_friction" : "driver_dead_zone"));
  const double dead = is_dead ? value(d, "driver_dead_zone", "u_d") * 12 : 0;
  EXPECT_NEAR(value(d, "driver_saturation", "e_max") + dead, 10.8, 0.5);
  EXPECT_NEAR(d["error"]["base"]["held_out"], 5.7, 0.6);
  EXPECT_NEAR(d["error"]["final"]["held_out"], 2.5, 0.3);
}

TEST_F(RealData, UnmotorHidesADeadZone) {
  const json d = diagnosed("unmotor", "unmotor/prbs_open.csv", {"@0:50"}, {"@50:"});
  EXPECT_EQ(d["verdict"], "found");
  EXPECT_THAT(names(d), ElementsAre("driver_dead_zone"));
  EXPECT_NEAR(value(d, "driver_dead_zone", "u_d"), 0.302, 0.01);  // known
  EXPECT_NEAR(d["signals"]["omega"]["rmse"], 0.107, 0.01);        // known
}

TEST_F(RealData, Xl330HidesAPendulumAndFrictionThatGrowsWithIt) {
  const json d = diagnosed("xl330", "xl330/xl330_pendulum.csv",
                           {"#sin_sin_100", "#sin_sin_400", "#up_and_down_100", "#up_and_down_400"},
                           {"#sin_sin_200", "#up_and_down_800"});
  EXPECT_EQ(d["verdict"], "unknown_effect");
  EXPECT_THAT(names(d), testing::IsSupersetOf({"eccentric_load", "load_dependent_friction"}));
  EXPECT_LT(d["error"]["final"]["held_out"].get<double>() / d["error"]["base"]["held_out"].get<double>(), 0.5);
}

TEST_F(RealData, EmpsHidesFrictionThatDiffersBetweenTheDirections) {
  const json d = diagnosed("emps", "emps/emps.csv", {"@0:14.9"}, {"@14.9:"});
  EXPECT_EQ(d["verdict"], "found");  // 1.7 % of how much the position varies is left, 83 noise floors
  EXPECT_THAT(names(d), ElementsAre("coulomb_friction", "asymmetric_friction"));
  EXPECT_NEAR(value(d, "coulomb_friction", "T_c"), 20.39, 2);                 // published
  EXPECT_NEAR(value(d, "asymmetric_friction", "B_d"), (166 - 240) / 2.0, 6);  // half the difference of the directions
  EXPECT_NEAR(d["parameters"]["B"]["value"], 203.5, 15);
  EXPECT_NEAR(d["error"]["base"]["held_out"].get<double>() / d["error"]["final"]["held_out"].get<double>(), 10.7, 0.3)
      << "docs/data/emps.md says so";

  const json law = discovered("emps", "emps/emps.csv@0:14.9", "emps/emps.csv@14.9:").at("laws").at(0);
  EXPECT_NEAR(law["error"]["after"]["held_out"], 31.2, 1.5) << "docs/data/emps.md says so";
  EXPECT_THAT(law["of"], ElementsAre("omega"));
}

}  // namespace
}  // namespace emtb
