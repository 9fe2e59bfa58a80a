#include "session/mat.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "hal/error.h"
#include "session/hdf5.h"
#include "session/spec.h"
#include "tests/session/foreign_readers.h"
#include "tests/session/scratch.h"

namespace emtb {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

Session two_runs() {
  Session s;
  s.runs.push_back(
      {.name = "up", .signals = {{Signal::omega, series({0, 0.1, 0.2}, {0, 1.5, 1e-17})}}, .field_on = 12});
  s.runs.push_back({.name = "down", .signals = {{Signal::omega, series({0, 0.1}, {3, 2})}}});
  Series& current = s.runs[0].signals[Signal::i_a];
  current = series({0.2}, {-0.25});
  current.window = 0.4;
  current.lsb = 0.01;
  current.source = "meter größer";
  s.events = {{0, event_code::run, "up"}, {0.15, 101, "over_speed"}, {1, event_code::run, "down"}};
  s.attributes = {{"bench", "fh2"}, {"note", "größer"}};
  s.config = "name: fh2\nrate: 1000\n";
  s.complete = false;
  return s;
}

class Mat : public Scratch {
 protected:
  std::string file(const std::string& name) { return path(name).string(); }
  /// What Octave saves of some lines.
  std::string saved(const std::string& lines, const std::string& variables) {
    octave(lines + "\nsave('-v7', '" + file("foreign.mat") + "', " + variables + ");");
    return file("foreign.mat");
  }
};

class MatVersions : public Mat, public testing::WithParamInterface<MatVersion> {};

TEST_P(MatVersions, ASessionComesBackAsItWas) {
  const Session wrote = two_runs();
  write_mat(file("s.mat"), wrote, GetParam());
  const Session s = read_mat(file("s.mat"));
  ASSERT_EQ(s.runs.size(), 2U);
  EXPECT_EQ(s.runs[0].name, "up");
  EXPECT_EQ(s.runs[1].name, "down");
  EXPECT_EQ(s.runs[0].field_on, 12);
  EXPECT_EQ(s.runs[0].at(Signal::omega).value, wrote.runs[0].at(Signal::omega).value);
  EXPECT_EQ(s.runs[0].at(Signal::omega).t, wrote.runs[0].at(Signal::omega).t);
  EXPECT_EQ(s.runs[0].at(Signal::i_a).window, 0.4);
  EXPECT_EQ(s.runs[0].at(Signal::i_a).lsb, 0.01);
  EXPECT_EQ(s.runs[0].at(Signal::i_a).source, "meter größer");
  ASSERT_EQ(s.events.size(), 3U);
  EXPECT_EQ(s.events[1].code, 101);
  EXPECT_EQ(s.events[1].text, "over_speed");
  EXPECT_EQ(s.attributes, wrote.attributes);
  EXPECT_EQ(s.config, wrote.config);
  EXPECT_FALSE(s.complete);
}

INSTANTIATE_TEST_SUITE_P(Both, MatVersions, testing::Values(MatVersion::v5, MatVersion::v73));

TEST_F(Mat, OctaveReadsWhatWasWritten) {
  write_mat(file("s.mat"), two_runs());
  EXPECT_EQ(octave("x = load('" + file("s.mat") + R"(');
printf('%s %d %s\n', x.format, numel(x.runs), x.runs(2).name);
printf('%g ', x.runs(1).signals.omega.value); printf('%g\n', x.runs(2).signals.omega.t(2));
printf('%s %s %g\n', x.runs(1).signals.i_a.unit, x.attributes.bench, x.runs(1).signals.i_a.window);
printf('%s %g\n', x.events.text{2}, x.events.code(2)); printf('%s', x.config);)"),
            "emtb session 1 2 down\n0 1.5 1e-17 0.1\nA fh2 0.4\nover_speed 101\nname: fh2\nrate: 1000\n");
}

TEST_F(Mat, EmtbsReaderForOctaveSplitsBothKindsOfFileIntoRuns) {
  write_mat(file("s.mat"), two_runs());
  write_hdf5(file("s.h5"), two_runs());
  for (const char* name : {"s.mat", "s.h5"}) {
    EXPECT_EQ(
        octave("addpath('" EMTB_SOURCE_DIR "/octave');\n[runs, events] = emtb_read('" + file(name) + R"(');
printf('%d %d\n', numel(runs), numel(events.t));
printf('%g ', runs{1}.omega.value, runs{2}.omega.value, runs{2}.omega.t, runs{1}.i_a.value); printf('\n');)"),
        std::string(name) == "s.mat" ? "2 3\n0 1.5 1e-17 3 2 0 0.1 -0.25 \n" : "2 4\n0 1.5 1e-17 3 2 0 0.1 -0.25 \n")
        << name;
  }
}

TEST_F(Mat, VectorsOfSomebodysFileAreColumns) {
  const auto s =
      read_session(saved("t_s = (0:3)'/10; omega_rpm = single([0 60 NaN 30]); u_ref_V = int8([0 1 1 2]');"
                         "other = 1:9;",
                         "'t_s', 'omega_rpm', 'u_ref_V', 'other'"));
  ASSERT_EQ(s.runs.size(), 1U);
  EXPECT_THAT(s.runs[0].at(Signal::u_ref).value, ElementsAre(0, 1, 1, 2));
  EXPECT_THAT(s.runs[0].at(Signal::omega).t, ElementsAre(0, 0.1, 0.3));
  EXPECT_NEAR(s.runs[0].at(Signal::omega).value[1], 6.283185, 1e-6);
}

TEST_F(Mat, AMappingReachesFieldsAndColumnsOfMatrices) {
  Mapping map;
  map.time = "log.time";
  map.columns[Signal::omega] = {.column = "y(:,2)", .scale = 2};
  map.columns[Signal::e_a] = {.column = "log.volts"};
  const auto s =
      read_session(saved("log.time = [5 6 7]; log.volts = [1 2 3]; y = [0 10; 0 20; 0 30];", "'log', 'y'"), map);
  EXPECT_THAT(s.runs[0].at(Signal::omega).value, ElementsAre(20, 40, 60));
  EXPECT_THAT(s.runs[0].at(Signal::e_a).t, ElementsAre(0, 1, 2));
}

TEST_F(Mat, ComplaintsNameFileAndVariable) {
  octave("cd('" + path("").string() + R"(');
speed = 1:3; clock = 1:3; save('-v7', 'timeless.mat', 'speed', 'clock');
signals.omega.t = 1:3; signals.omega.value = 1:2; save('-v7', 'short.mat', 'signals');
signals.omega.t = [1 3 2]; signals.omega.value = 1:3; save('-v7', 'back.mat', 'signals');
signals.omega.value = {1, 2, 3}; save('-v7', 'cells.mat', 'signals');
signals.omega.t = 1:3; signals.omega.value = 1:3; signals.omega.unit = 'rpm'; save('-v7', 'unit.mat', 'signals');
format = 'emtb session 2'; runs = 1; save('-v7', 'newer.mat', 'format', 'runs');)");
  const auto complaint = [&](const std::string& name) {
    return message_of<SessionError>([&] { read_session(file(name)); });
  };
  EXPECT_THAT(complaint("timeless.mat"),
              AllOf(HasSubstr("timeless.mat"), HasSubstr("time: VARIABLE"), HasSubstr("clock"), HasSubstr("speed")));
  EXPECT_THAT(complaint("short.mat"), HasSubstr("signals.omega has 3 times but 2 values"));
  EXPECT_THAT(complaint("back.mat"), HasSubstr("signals.omega goes back in time in row 3"));
  EXPECT_THAT(complaint("cells.mat"), HasSubstr("real numbers"));
  EXPECT_THAT(complaint("unit.mat"), HasSubstr("unit rpm. Convert it to rad/s"));
  EXPECT_THAT(complaint("newer.mat"), HasSubstr("made by a newer emtb"));
  write("text.mat",
        "this is no such file, but it is long enough for a header of one hundred and twenty-eight bytes ...");
  EXPECT_THAT(message_of<SessionError>([&] { read_session(file("text.mat")); }), HasSubstr("text.mat"));
}

TEST_F(Mat, ADamagedFileIsRefusedAndNothingElseHappens) {
  write_mat(file("s.mat"), two_runs());
  const std::string whole = read(file("s.mat"));
  int refused = 0;
  for (std::size_t cut = 130; cut < whole.size(); cut += whole.size() / 12) {
    write("cut.mat", whole.substr(0, cut));
    try {
      read_session(file("cut.mat"));
    } catch (const SessionError&) {
      ++refused;
    }
  }
  EXPECT_GE(refused, 2);
}

}  // namespace
}  // namespace emtb
