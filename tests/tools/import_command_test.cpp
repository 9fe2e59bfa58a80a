#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "session/spec.h"
#include "tests/tools/command_caller.h"

namespace emtb {
namespace {

using testing::HasSubstr;

constexpr double meters_window = 0.4;   // [s]
constexpr double clocks_apart = 37.25;  // [s] t = t_log + this

/// `emtb import RUN --from-log METER`: a run of the FH2 without a current, and what a meter's own software wrote of it.
class ImportCommand : public CommandCaller {
 protected:
  void SetUp() override {
    // The machine under a slow driver that goes up and down again; the meter began when it began.
    constexpr double R_a = 31.8, K = 0.67, B = 1e-4, J = 3.4e-3, T_c = 0.055, step = 1e-3;
    std::ostringstream run, log;
    run << "t_s,omega_rad_s,e_a_V\n";
    log << "Time [s];Display [mA];Mode\n";
    double omega = 0;
    double charge = 0;
    double from = 0.13;
    for (double t = 0; t < 30; t += step) {
      const double e_a = std::clamp(22.5 * (t - 2), 0.0, 100.0) - std::clamp(20.4 * (t - 17), 0.0, 60.0);
      const double i_a = (e_a - K * omega) / R_a;
      const double torque = K * i_a - B * omega;
      omega = std::max(0.0, omega + step / J * (omega > 0 || torque > T_c ? torque - T_c : 0));
      run << t << "," << omega << "," << e_a << "\n";
      if (t < from) continue;
      charge += i_a * step;
      if (t - from < meters_window) continue;
      std::ostringstream shown;  // as the software of a German meter does
      shown << t - clocks_apart << ";" << std::round(1000 * charge / (t - from)) << ",0;DC";
      std::string line = shown.str();
      std::ranges::replace(line, '.', ',');
      log << line << "\n";
      charge = 0;
      from = t;
    }
    run_ = write("run.csv", run.str()).string();
    log_ = write("meter.csv", log.str()).string();
    map_ = write("map.yaml",
                 "time: Time [s]\ncolumns:\n  i_a: {from: \"Display [mA]\", unit: mA}\nwindow: {i_a: 0.4}\n"
                 "delimiter: \";\"\ndecimal: \",\"\n")
               .string();
  }
  int import(std::vector<std::string> words) {
    words.insert(words.begin(), "import");
    return call(std::move(words));
  }
  int merge(const std::string& run, const std::string& log) {
    return import({run, "--from-log", log, "--map", map_, "--out", path("both.h5").string()});
  }

  std::string run_, log_, map_;
};

TEST_F(ImportCommand, PutsTheLogOfAMeterWhereItBelongsInTheRun) {
  ASSERT_EQ(merge(run_, log_), 0) << last->err();
  EXPECT_THAT(last->out(), HasSubstr(" readings of the log: its clock plus 0.5"));
  const Session both = read_session(path("both.h5"));
  const Run& run = both.runs.at(0);
  const Series& i_a = run.at(Signal::i_a);
  EXPECT_EQ(i_a.window, meters_window);
  EXPECT_GT(i_a.t.size(), 60U);
  EXPECT_NEAR(i_a.t.front(), 0.13 + meters_window, 0.1);
  EXPECT_NEAR(*std::ranges::max_element(i_a.value), 22.5 * 3.4e-3 / 0.67 / 0.67 + 0.055 / 0.67, 0.03)
      << "[A] acceleration and friction";
  EXPECT_EQ(run.at(Signal::omega).t.size(), 30'000U) << "what was there stays";
  EXPECT_THAT(both.attributes.at("note"), HasSubstr("i_a from " + log_));
}

TEST_F(ImportCommand, RefusesInOneLineALogThatCannotBePlaced) {
  const auto complaint = [&](const std::string& run, const std::string& log) {
    EXPECT_EQ(merge(run, log), 2) << last->out();
    EXPECT_FALSE(std::filesystem::exists(path("both.h5")));
    std::string line = last->err();
    EXPECT_EQ(std::ranges::count(line, '\n'), 1) << line;
    return line;
  };
  EXPECT_THAT(complaint(run_, path("none.csv").string()), HasSubstr("none.csv"));
  EXPECT_THAT(complaint(run_, write("short.csv", "Time [s];Display [mA]\n0,4;100,0\n0,8;101,0\n").string()),
              HasSubstr("the log has 2 readings; 12 are the least"));
  std::ostringstream other;  // of a day on which nothing like this happened
  other << "Time [s];Display [mA]\n";
  for (int k = 0; k < 70; ++k) other << 4 * k / 10 << "," << 4 * k % 10 << ";" << (k * 7919 % 503) << "\n";
  EXPECT_THAT(complaint(run_, write("other.csv", other.str()).string()),
              HasSubstr("the log does not look like the run anywhere"));
  EXPECT_THAT(complaint(run_, write("volts.csv", "Time [s];Volts\n0,4;1\n0,8;2\n").string()),
              HasSubstr("Display [mA]"));
  ASSERT_EQ(import({run_, "--from-log", log_, "--map", map_, "--out", path("once.csv").string()}), 0) << last->err();
  EXPECT_THAT(complaint(path("once.csv").string(), log_), HasSubstr("has an i_a already. A log may only add one"));
}

TEST_F(ImportCommand, WantsToKnowWhereTheSessionGoes) {
  EXPECT_EQ(import({run_, "--from-log", log_, "--map", map_}), 2);
  EXPECT_THAT(last->err(), HasSubstr("--out FILE is missing: where the session goes, .csv, .h5 or .mat"));
  EXPECT_EQ(import({run_, run_, "--from-log", log_, "--map", map_, "--out", path("x.csv").string()}), 2);
  EXPECT_THAT(last->err(), HasSubstr("one SESSION at a time"));
}

TEST_F(ImportCommand, GoesThroughBothKindsOfMatAndBackUnchanged) {
  ASSERT_EQ(call({"export", run_, "--out", path("plain.csv")}), 0) << last->err();
  for (const char* version : {"5", "7.3"}) {
    ASSERT_EQ(call({"export", run_, "--out", path("x.mat"), "--mat", version}), 0) << last->err();
    EXPECT_TRUE(read(path("x.mat")).starts_with("MATLAB " + std::string(version)));
    ASSERT_EQ(call({"import", path("x.mat"), "--out", path("back.csv")}), 0) << last->err();
    EXPECT_EQ(read(path("back.csv")), read(path("plain.csv")));
  }
  EXPECT_EQ(call({"export", run_, "--out", path("x.mat"), "--mat", "6"}), 2);
  EXPECT_THAT(last->err(), HasSubstr("--mat 6: not known. Known: 5, 7.3"));
  EXPECT_EQ(call({"export", run_, "--out", path("x.h5"), "--mat", "7.3"}), 2);
  EXPECT_THAT(last->err(), HasSubstr("is for --out FILE.mat"));
}

}  // namespace
}  // namespace emtb
