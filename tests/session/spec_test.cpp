#include "session/spec.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "tests/session/scratch.h"

namespace emtb {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class Spec : public Scratch {
 protected:
  std::string file(const std::string& name, const std::string& text) const { return write(name, text).string(); }
  std::string complaint(const std::string& spec) const {
    return message_of<SessionError>([&] { read_runs(spec); });
  }
};

TEST_F(Spec, NamesAFileARunAndASpan) {
  const SessionSpec all = parse_session_spec("data/steps.csv");
  EXPECT_EQ(all.path, "data/steps.csv");
  EXPECT_EQ(all.run, "");
  EXPECT_FALSE(all.t0 || all.t1);
  const SessionSpec spec = parse_session_spec("steps.h5#up 2@1.5:3e1");
  EXPECT_EQ(spec.path, "steps.h5");
  EXPECT_EQ(spec.run, "up 2");
  EXPECT_EQ(spec.t0, 1.5);
  EXPECT_EQ(spec.t1, 30);
  EXPECT_EQ(parse_session_spec("steps.CSV@2:").t0, 2);
  EXPECT_FALSE(parse_session_spec("steps.csv@2:").t1);
  EXPECT_EQ(parse_session_spec("steps.csv@:5").t1, 5);
  EXPECT_FALSE(parse_session_spec("steps.csv@:5").t0);
}

TEST_F(Spec, FoldersAndRunsMayContainHashAndAt) {
  EXPECT_EQ(parse_session_spec("me@home#1/steps.csv#a@1:2").path, "me@home#1/steps.csv");
  EXPECT_EQ(parse_session_spec("me@home:2/steps.csv").path, "me@home:2/steps.csv");
  EXPECT_EQ(parse_session_spec("old.csv#1/steps.csv@:2").path, "old.csv#1/steps.csv");
  EXPECT_EQ(parse_session_spec("all.csv#me@home").run, "me@home");
  EXPECT_EQ(parse_session_spec("all.csv#step.csv").run, "step.csv");
  EXPECT_EQ(parse_session_spec("all.csv#dir/step").run, "dir/step");
}

TEST_F(Spec, TheFileThatExistsDecides) {
  const std::string odd = file("all.csv#b.csv", "t_s,omega_rad_s\n0,1\n");
  EXPECT_EQ(parse_session_spec(odd).path, odd);
  file("all.csv", "run,t_s,omega_rad_s\nb.csv,0,1\n");
  EXPECT_EQ(parse_session_spec(odd).run, "b.csv");
}

TEST_F(Spec, AMalformedOneIsToldTheForm) {
  EXPECT_THAT(complaint("steps.txt"), HasSubstr("steps.txt: is not a session. A session is PATH[#RUN][@T0:T1]"));
  EXPECT_THAT(complaint(""), HasSubstr("is not a session"));
  EXPECT_THAT(complaint("a.csv#"), HasSubstr("names no run"));
  EXPECT_THAT(complaint("a.csv@5"), HasSubstr("has no colon"));
  EXPECT_THAT(complaint("a.csv@"), HasSubstr("has no colon"));
  EXPECT_THAT(complaint("a.csv@:"), HasSubstr("neither beginning nor end"));
  EXPECT_THAT(complaint("a.csv@3:1"), HasSubstr("ends before it begins"));
  EXPECT_THAT(complaint("a.csv@1:1"), HasSubstr("ends before it begins"));
  EXPECT_THAT(complaint("a.csv@x:1"), HasSubstr("`x` is not a time"));
  EXPECT_THAT(complaint("a.csv@-1:1"), HasSubstr("`-1` is not a time"));
  EXPECT_THAT(complaint("a.csv@1:inf"), HasSubstr("`inf` is not a time"));
  EXPECT_THAT(complaint("a.csv@1:2@3:4"), HasSubstr("names no run"));
}

TEST_F(Spec, WithoutARunAllAreReadEachUnderItsName) {
  const std::string path = file("two.csv", "run,t_s,omega_rad_s\na,0,1\nb,0,2\n");
  const auto runs = read_runs(path);
  ASSERT_EQ(runs.size(), 2u);
  EXPECT_EQ(runs[0].name, path + "#a");
  EXPECT_EQ(runs[1].name, path + "#b");
  EXPECT_THAT(read_runs(path + "#b").at(0).at(Signal::omega).value, ElementsAre(2));
  const std::string single = file("one.csv", "t_s,omega_rad_s\n0,1\n");
  EXPECT_EQ(read_runs(single).at(0).name, single);
}

TEST_F(Spec, ARunOrSpanThatDoesNotExistIsToldSo) {
  const std::string path = file("two.csv", "run,t_s,omega_rad_s\na,0,1\na,2,1\nb,0,2\n");
  EXPECT_THAT(complaint(path + "#c"), HasSubstr("two.csv: no run `c`. Runs here: a, b"));
  EXPECT_THAT(complaint(path + "#a@3:"),
              HasSubstr("two.csv#a: the span @3: holds no reading; the run lasts from 0 to 2 s"));
  EXPECT_THAT(complaint(path + "@1:"), HasSubstr("two.csv#b: the span @1: holds no reading"));
  EXPECT_THAT(complaint(file("one.csv", "t_s,omega_rad_s\n0,1\n") + "#a"),
              HasSubstr("It holds a single run: leave out #a"));
}

TEST_F(Spec, ASpanCutsNoRowInTwoWhoseTimesDifferByTheirRounding) {
  Run run{.name = "ramp", .signals = {}, .field_on = 0};
  run.signals[Signal::u_ref] = {.t = {2.495, 2.496, 2.497, 2.498}, .value = {1, 2, 3, 4}, .source = "u"};
  run.signals[Signal::e_a] = {
      .t = {2.495, 2.496 - 4e-16 * 2, 2.497, 2.498 - 4e-16 * 2}, .value = {5, 6, 7, 8}, .source = "e"};
  ASSERT_LT(run.at(Signal::e_a).t[1], 2.496);
  const Run piece = cut(run, 2.496, 2.498);
  EXPECT_EQ(piece.at(Signal::u_ref).value, (std::vector<double>{2, 3}));
  EXPECT_EQ(piece.at(Signal::e_a).value, (std::vector<double>{6, 7}));
  EXPECT_EQ(piece.at(Signal::e_a).t, piece.at(Signal::u_ref).t);
}

TEST_F(Spec, ASpanIsHalfOpenAndStartsAtZero) {
  const std::string path = file("s.csv", "t_s,omega_rad_s\n0,0\n0.1,1\n0.2,2\n0.3,3\n0.4,4\n");
  const Run middle = read_runs(path + "@0.1:0.3").at(0);
  EXPECT_THAT(middle.at(Signal::omega).t, ElementsAre(0, 0.1));
  EXPECT_THAT(middle.at(Signal::omega).value, ElementsAre(1, 2));
  EXPECT_EQ(middle.name, path + "@0.1:0.3");
  EXPECT_THAT(read_runs(path + "@0.3:").at(0).at(Signal::omega).value, ElementsAre(3, 4));
  EXPECT_THAT(read_runs(path + "@:0.1").at(0).at(Signal::omega).value, ElementsAre(0));
  EXPECT_THAT(read_runs(path + "@0.25:").at(0).at(Signal::omega).t, ElementsAre(0.05, 0.15))
      << "counted from the span's start";
}

class SlowMeterSpan : public Spec {
 protected:
  /// omega every 0.1 s, i_a every 0.4 s.
  std::string recording() const {
    std::string text = "t_s,omega_rad_s,i_a_A\n";
    for (int i = 0; i <= 20; ++i) {
      text += std::to_string(i / 10) + "." + std::to_string(i % 10) + ",1," +
              (i % 4 == 0 && i > 0 ? std::to_string(i / 4) : "") + "\n";
    }
    return file("slow.csv", text);
  }
};

TEST_F(SlowMeterSpan, DropsTheReadingWhoseMeanBeganBefore) {
  const Run run = read_runs(recording() + "@0.5:1.7").at(0);
  EXPECT_THAT(run.at(Signal::i_a).t, ElementsAre(0.7, 1.1)) << "0.8 s is the mean since 0.4 s";
  EXPECT_THAT(run.at(Signal::i_a).value, ElementsAre(3, 4));
  EXPECT_NEAR(window_start(run.at(Signal::i_a), 0), 0.3, 1e-12);
  EXPECT_THAT(read_runs(recording() + "@0.8:1.3").at(0).at(Signal::i_a).value, ElementsAre(3))
      << "begins with the span";
}

TEST_F(SlowMeterSpan, KeepsAReadingWhoseStatedWindowLiesWithin) {
  Mapping mapping;
  mapping.window[Signal::i_a] = 0.2;
  EXPECT_THAT(read_runs(recording() + "@0.5:1.7", mapping).at(0).at(Signal::i_a).value, ElementsAre(2, 3, 4));
  EXPECT_THAT(read_runs(recording() + "@0.7:1.7", mapping).at(0).at(Signal::i_a).value, ElementsAre(3, 4));
}

TEST_F(SlowMeterSpan, KeepsEachRowOfASignalThatIsReadAsOftenAsAnyOther) {
  Mapping mapping;
  mapping.window[Signal::omega] = 0.1;
  EXPECT_THAT(read_runs(recording() + "@0.5:0.8", mapping).at(0).at(Signal::omega).t.size(), 3)
      << "which may be what drives the motor";
}

TEST_F(SlowMeterSpan, ASpanFromTheStartLosesNothing) {
  EXPECT_EQ(read_runs(recording() + "@:2.1").at(0).at(Signal::i_a).value.size(), 5u);
  EXPECT_EQ(read_runs(recording() + "@0:2.1").at(0).at(Signal::i_a).value.size(), 5u);
}

TEST_F(Spec, TheResolutionIsEstimatedOverAllRuns) {
  std::string text = "run,t_s,omega_rad_s,u_ref_V\n";
  for (int i = 0; i < 200; ++i) {
    const std::string run = i < 100 ? "a" : "b";
    text += run + "," + std::to_string(i) + "," + std::to_string(0.125 * ((i * 7) % 11)) + ",2\n";
  }
  const Session session = read_session(file("lsb.csv", text));
  for (const Run& run : session.runs) {
    EXPECT_DOUBLE_EQ(run.at(Signal::omega).lsb, 0.125);
    EXPECT_EQ(run.at(Signal::u_ref).lsb, 0);
  }
}

TEST_F(Spec, TheResolutionOfAMeterWithThreeReadingsARunIsToldByAllFilesTogether) {
  std::vector<std::string> files;
  for (int f = 0; f < 8; ++f) {
    std::string text = "t_s,u_ref_V,omega_rad_s,i_a_A\n";
    for (int k = 0; k < 120; ++k) {
      const std::string i_a = k % 40 == 39 ? std::to_string(0.0757691 * ((5 * f + 7 * k) % 31 - 15)) : "";
      text += std::to_string(0.01 * k) + ",2," + std::to_string(std::sin(f + 0.37 * k)) + "," + i_a + "\n";
    }
    files.push_back(file("short" + std::to_string(f) + ".csv", text));
  }
  EXPECT_EQ(read_runs(files[0]).at(0).at(Signal::i_a).lsb, 0) << "three readings tell nothing";
  for (const Run& run : read_runs(files, {})) {
    EXPECT_NEAR(run.at(Signal::i_a).lsb, 0.0757691, 1e-5);
    EXPECT_EQ(run.at(Signal::u_ref).lsb, 0) << "it is set";
  }
}

TEST_F(Spec, OtherEndingsAreNeitherReadNorWritten) {
  EXPECT_THAT(message_of<SessionError>([&] { read_session("x.txt"); }),
              HasSubstr("x.txt: is none of .csv, .h5 and .mat"));
  EXPECT_THAT(message_of<SessionError>([&] { write_session(path("x.txt"), {}); }),
              HasSubstr("is none of .csv, .h5 and .mat"));
}

TEST_F(Spec, AnAngleThatBeginsAnewWithEachTurnIsPutTogether) {
  std::string text = "t_s,theta_rad\n";
  for (int k = 0; k < 100; ++k)
    text += std::to_string(0.01 * k) + "," + std::to_string(std::fmod(0.002 * k * k, 2 * std::numbers::pi)) + "\n";
  const Series theta = read_runs(file("absolute.csv", text)).front().at(Signal::theta);
  EXPECT_NEAR(theta.value.back(), 0.002 * 99 * 99, 1e-5);
  EXPECT_NEAR(theta.begins_anew_after, 2 * std::numbers::pi, 1e-9);
}

}  // namespace
}  // namespace emtb
