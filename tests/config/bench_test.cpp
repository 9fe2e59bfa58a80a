#include "config/bench.h"

#include "tests/config/complains.h"
#include "tests/temporary_file.h"

namespace emtb {
namespace {

using ::testing::HasSubstr;

const std::string good =
    "name: b\n"                                                      // 1
    "rate: 2000\n"                                                   // 2
    "realtime: off\n"                                                // 3
    "reference: {device: daq, min: -1, max: 6, safe: 0, rate: 3}\n"  // 4
    "limits:\n"                                                      // 5
    "  omega: 190\n"                                                 // 6
    "  time: 60\n"                                                   // 7
    "devices:\n"                                                     // 8
    "  daq: {driver: simulated_daq, bits: 12}\n"                     // 9
    "  meter: {driver: simulated_meter}\n"                           // 10
    "simulation: {pace: 1}\n";                                       // 11

BenchConfig bench(const std::string& text) {
  const TemporaryFile file(".yaml", text);
  return read_bench(file.path());
}

/// The complaint about the good file with one thing changed, without the folder.
std::string bad(const std::string& from, const std::string& to) {
  std::string text = good;
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
  const std::string line = complaint([&] { bench(text); });
  return "b.yaml" + line.substr(line.find(".yaml:") + 5);
}

TEST(BenchFile, ReadsAll) {
  const BenchConfig b = bench(good);
  EXPECT_EQ(b.name, "b");
  EXPECT_DOUBLE_EQ(b.rate, 2000);
  EXPECT_EQ(b.realtime, Realtime::off);
  EXPECT_EQ(b.reference.device, "daq");
  EXPECT_DOUBLE_EQ(b.reference.limits.min, -1);
  EXPECT_DOUBLE_EQ(b.reference.limits.max, 6);
  EXPECT_DOUBLE_EQ(b.reference.limits.safe, 0);
  EXPECT_DOUBLE_EQ(b.reference.rate, 3);
  EXPECT_EQ(b.limits.omega, 190);
  EXPECT_EQ(b.limits.time, 60);
  EXPECT_FALSE(b.limits.i_a);
  EXPECT_FALSE(b.limits.torque);
  ASSERT_EQ(b.devices.size(), 2U);
  EXPECT_EQ(b.devices[0].name, "daq");
  EXPECT_EQ(b.devices[1].driver, "simulated_meter");
  EXPECT_DOUBLE_EQ(b.devices[0].yaml.number("bits"), 12);
  ASSERT_TRUE(b.simulation);
  EXPECT_DOUBLE_EQ(b.simulation->number("pace"), 1);
  EXPECT_EQ(b.text, good);
}

TEST(BenchFile, KnowsUsualValues) {
  const BenchConfig b = bench("name: b\nreference: {device: d, min: 0, max: 6, safe: 0}\ndevices: {d: {driver: x}}\n");
  EXPECT_DOUBLE_EQ(b.rate, 1000);
  EXPECT_EQ(b.realtime, Realtime::prefer);
  EXPECT_DOUBLE_EQ(b.reference.rate, 0);
  EXPECT_FALSE(b.simulation);
}

TEST(BenchFile, NamesTheModelOfTheLiveEstimatesFromWhereItIs) {
  EXPECT_FALSE(bench(good).estimates);
  const TemporaryFile file(".yaml", good + "estimates: {model: ../models/m.yaml, rate: 20}\n");
  const auto estimates = read_bench(file.path()).estimates;
  ASSERT_TRUE(estimates);
  EXPECT_EQ(estimates->model, std::filesystem::path(file.path()).parent_path() / "../models/m.yaml");
  EXPECT_DOUBLE_EQ(estimates->rate, 20);
  // A bench that was copied elsewhere, as to /etc/emtb: its model is among those that come with emtb.
  const TemporaryFile copy(".yaml", good + "estimates: {model: ../models/fh2.yaml}\n");
  const auto ours = read_bench(copy.path()).estimates->model;
  EXPECT_TRUE(std::filesystem::exists(ours)) << ours;
  EXPECT_EQ(ours.filename(), "fh2.yaml");
  EXPECT_THAT(bad("simulation: {pace: 1}", "estimates: {model: m.yaml, rate: 100}"), HasSubstr("b.yaml:11: "));
}

TEST(BenchFile, EachMistakeHasItsLine) {
  EXPECT_EQ(
      bad("rate: 2000", "rat: 2000"),
      "b.yaml:2: rat is not known here. Known: format, name, rate, realtime, reference, limits, field, motor, tacho, "
      "spin, estimates, devices, simulation");
  EXPECT_EQ(bad("rate: 2000", "rate: fast"), "b.yaml:2: rate must be a number, not `fast`");
  EXPECT_EQ(bad("rate: 2000", "rate: 20000"), "b.yaml:2: rate is 20000, but must be 100 to 10000");
  EXPECT_EQ(bad("rate: 2000", "rate: 50"), "b.yaml:2: rate is 50, but must be 100 to 10000");
  EXPECT_EQ(bad("rate: 2000", "name: c"), "b.yaml:2: name stands twice. Keep one");
  EXPECT_EQ(bad("name: b\n", ""), "b.yaml:1: name is missing");
  EXPECT_EQ(bad("realtime: off", "realtime: never"), "b.yaml:3: realtime is `never`. Known: require, prefer, off");
  EXPECT_EQ(bad("  omega: 190", "  speed: 190"),
            "b.yaml:6: limits.speed is not known here. Known: omega, i_a, torque, time");
  EXPECT_EQ(bad("  omega: 190", "  omega: -190"), "b.yaml:6: limits.omega is -190, but must be above 0");
  EXPECT_EQ(bad("  daq: {driver: simulated_daq, bits: 12}", "  daq: {bits: 12}"),
            "b.yaml:9: devices.daq.driver is missing");
  EXPECT_EQ(bad("  daq: {driver: simulated_daq, bits: 12}", "  daq: simulated_daq"),
            "b.yaml:9: devices.daq must be a map of `key: value` lines");
  EXPECT_EQ(bad("  meter:", "  daq:"), "b.yaml:10: devices.daq stands twice. Keep one");
}

TEST(BenchFile, TheReferenceMakesSense) {
  EXPECT_EQ(bad("device: daq", "device: dac"),
            "b.yaml:4: reference.device is `dac`, which `devices` does not have. It has: daq, meter");
  EXPECT_EQ(
      bad("safe: 0", "safe: 7"),
      "b.yaml:4: reference.safe is 7 V, but the reference goes from -1 V to 6 V. Write a value within, usually 0");
  EXPECT_EQ(bad("max: 6", "max: -1"), "b.yaml:4: reference.max is -1 V, but min is -1 V. Write a max above min");
  EXPECT_EQ(bad("safe: 0, ", ""), "b.yaml:4: reference.safe is missing");
  EXPECT_EQ(bad("rate: 3}", "rate: -3}"), "b.yaml:4: reference.rate is -3, but must be 0 or more");
}

TEST(BenchFile, WhatGuardsFieldAndTachoIsOptionalAndChecked) {
  const BenchConfig none = bench(good);
  EXPECT_FALSE(none.field_min);
  EXPECT_FALSE(none.tacho);
  EXPECT_DOUBLE_EQ(none.spin.u_ref, 1) << "a sixth of 6 V";
  const std::string guards =
      "field: {min: 0.2}\nmotor: {R_a: 32, K_b: 0.67, driver_gain: 18}\ntacho: {emf: 20, omega: 5}\n"
      "spin: {u_ref: 0.5}\n";
  const BenchConfig b = bench(good + guards);
  EXPECT_EQ(b.field_min, 0.2);
  EXPECT_EQ(b.motor.R_a, 32);
  EXPECT_EQ(b.motor.driver_gain, 18);
  ASSERT_TRUE(b.tacho);
  EXPECT_EQ(b.tacho->emf, 20);
  EXPECT_EQ(b.tacho->time, 1);
  EXPECT_EQ(b.spin.u_ref, 0.5);
  EXPECT_THAT(complaint([&] { bench(good + "tacho: {emf: 20, omega: 5}\n"); }),
              HasSubstr("tacho needs the armature's resistance"));
  EXPECT_THAT(complaint([&] { bench(good + "motor: {R_a: 32, K_b: 1}\ntacho: {emf: 20, omega: 15}\n"); }),
              HasSubstr("Write 10 rad/s or less"));
  EXPECT_THAT(complaint([&] { bench(good + "spin: {u_ref: 7}\n"); }), HasSubstr("spin.u_ref is 7"));
}

TEST(BenchFile, WithoutDevicesThereIsNoBench) {
  EXPECT_THAT(complaint([] { bench("name: b\nreference: {device: d, min: 0, max: 6, safe: 0}\ndevices: {}\n"); }),
              HasSubstr(":3: devices is empty"));
}

TEST(ShippedBenches, AllRead) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(EMTB_SOURCE_DIR "/config/benches")) {
    const BenchConfig b = read_bench(entry.path());
    EXPECT_EQ(b.name, entry.path().stem());
    ++count;
  }
  EXPECT_GE(count, 2);
}

}  // namespace
}  // namespace emtb
