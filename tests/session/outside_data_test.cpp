// Recordings of benches that are not ours, through the mappings that ship with emtb.
#include "tests/outside_data.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <filesystem>

#include "config/mapping.h"
#include "session/spec.h"

namespace emtb {
namespace {

const std::filesystem::path source = EMTB_SOURCE_DIR;

class OutsideData : public testing::Test {
 protected:
  using Run = emtb::Run;  // not testing::Test::Run

  void SetUp() override {
    if (const std::string none = no_outside_data(); !none.empty()) GTEST_SKIP() << none;
  }
  static std::string data(const std::string& name) { return (outside_data() / name).string(); }
  static Mapping mapping(const std::string& name) { return read_mapping(source / "config/mappings" / name); }
};

TEST_F(OutsideData, EmpsIsACurrentDriveOnALinearAxis) {
  const auto runs = read_runs(data("emps/emps.csv"), mapping("emps.yaml"));
  ASSERT_EQ(runs.size(), 1u);
  EXPECT_EQ(runs[0].at(Signal::i_a).t.size(), 24841u);
  EXPECT_DOUBLE_EQ(runs[0].at(Signal::i_a).value[0], 2.538628);
  EXPECT_DOUBLE_EQ(runs[0].at(Signal::theta).value[1], 0.00001430);
  EXPECT_DOUBLE_EQ(runs[0].duration(), 24.84);
  EXPECT_EQ(runs[0].signals.size(), 2u);
  const auto train = read_runs(data("emps/emps.csv@0:14.9"), mapping("emps.yaml"));
  const auto held_out = read_runs(data("emps/emps.csv@14.9:"), mapping("emps.yaml"));
  EXPECT_EQ(train[0].at(Signal::theta).t.size() + held_out[0].at(Signal::theta).t.size(), 24841u);
}

TEST_F(OutsideData, IntecoCoastsWithTheArmatureOpen) {
  const auto runs = read_runs(data("inteco_servo/inteco_servo.csv"), mapping("inteco.yaml"));
  ASSERT_EQ(runs.size(), 3u);
  EXPECT_TRUE(runs[0].name.ends_with("inteco_servo.csv#steps_up"));
  EXPECT_TRUE(std::ranges::all_of(runs[0].at(Signal::armature_open).value, [](double open) { return open == 0; }));
  const Series& open = runs[1].at(Signal::armature_open);
  EXPECT_EQ(open.value.front(), 0);
  EXPECT_EQ(open.value.back(), 1);
  const auto cut = std::ranges::find(open.value, 1.0) - open.value.begin();
  EXPECT_NEAR(open.t[static_cast<std::size_t>(cut)], 14.0, 0.011);
  EXPECT_TRUE(runs[2].has(Signal::e_a) && runs[2].has(Signal::theta) && runs[2].has(Signal::omega));
}

TEST_F(OutsideData, Jga25StepsFromDutyToDuty) {
  const auto runs = read_runs(data("jga25_steps/jga25_steps.csv"), mapping("jga25.yaml"));
  ASSERT_EQ(runs.size(), 104u);
  for (const Run& run : runs) {
    EXPECT_EQ(run.at(Signal::u_ref).t.front(), 0);
    EXPECT_LE(std::abs(run.at(Signal::u_ref).value.back()), 1);
    EXPECT_EQ(run.at(Signal::u_ref).lsb, 0) << "the steps' levels are no resolution";
  }
  EXPECT_NEAR(runs[0].at(Signal::u_ref).value.back(), -5299.0 / 5319, 1e-12);
}

TEST_F(OutsideData, TheSlowMeterOfTheSimulatedBenchIsSparse) {
  const auto begin = std::chrono::steady_clock::now();
  const auto runs = read_runs(data("practice/slow1/ramp.csv"));
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  RecordProperty("seconds", std::to_string(took.count()));
  ASSERT_EQ(runs.size(), 1u);
  EXPECT_TRUE(is_sparse(runs[0], Signal::i_a));
  EXPECT_EQ(runs[0].at(Signal::i_a).window, 0);
  EXPECT_DOUBLE_EQ(window_start(runs[0].at(Signal::i_a), 0), 0);
  EXPECT_NEAR(runs[0].at(Signal::e_a).lsb, 260.0 / 4096, 1e-3);    // ±130 V, 12 bits
  EXPECT_NEAR(runs[0].at(Signal::omega).lsb, 400.0 / 4096, 1e-3);  // ±200 rad/s
}

}  // namespace
}  // namespace emtb
