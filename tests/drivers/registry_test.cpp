#include "drivers/registry.h"

#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <map>

#include "config/profile.h"
#include "drivers/simulated/open.h"
#include "drivers/simulated/paced_clock.h"
#include "hal/error.h"
#include "tests/temporary_file.h"

namespace emtb {
namespace {

using ::testing::HasSubstr;

const std::string good =
    "name: b\n"                                                          // 1
    "reference: {device: daq, min: -6, max: 6, safe: 0}\n"               // 2
    "devices:\n"                                                         // 3
    "  daq:\n"                                                           // 4
    "    driver: simulated_daq\n"                                        // 5
    "    channels:\n"                                                    // 6
    "      omega: {range: [-600, 600], noise: 0.3, correlation: 0.5}\n"  // 7
    "  meter: {driver: simulated_meter, period: 0.4}\n"                  // 8
    "simulation:\n"                                                      // 9
    "  pace: max\n"                                                      // 10
    "  motor: {R_a: 1.2, K_b: 0.042, K_m: 0.042, J: 6.0e-5}\n"           // 11
    "  friction: {law: hard, T_c: 0.003}\n";                             // 12

BenchConfig config(const std::string& text) {
  const TemporaryFile file(".yaml", text);
  return read_bench(file.path());
}

/// What open_bench says about the good file with one thing changed, without the folder.
std::string bad(const std::string& from, const std::string& to) {
  std::string text = good;
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
  try {
    open_bench(config(text));
  } catch (const ConfigError& e) {
    const std::string line = e.what();
    return "b.yaml" + line.substr(line.find(".yaml:") + 5);
  }
  return "";
}

BenchConfig shipped(const std::string& name) { return read_bench(EMTB_SOURCE_DIR "/config/benches/" + name + ".yaml"); }

TEST(Registry, OpensWhatTheFileNames) {
  const Bench bench = open_bench(config(good));
  ASSERT_TRUE(bench.clock);
  ASSERT_EQ(bench.inputs.size(), 2U);
  EXPECT_EQ(bench.inputs[0]->channels()[0].signal, Signal::omega);
  EXPECT_DOUBLE_EQ(bench.inputs[0]->channels()[0].period, 1e-3);
  EXPECT_EQ(bench.inputs[1]->channels()[0].signal, Signal::i_a);
  ASSERT_TRUE(bench.reference);
  EXPECT_EQ(bench.reference->limits().min, -6);
}

TEST(Registry, EachMistakeHasItsLine) {
  EXPECT_EQ(bad("driver: simulated_daq", "driver: simulated_dac"),
            "b.yaml:5: devices.daq.driver is `simulated_dac`. Known: comedi, modbus_meter, program, scpi_meter, "
            "serial_daq, serial_meter, "
            "simulated_daq, "
            "simulated_meter, usb1608g");
  EXPECT_EQ(bad("device: daq", "device: meter"), "b.yaml:2: reference.device is `meter`, which has no analog output");
  EXPECT_EQ(bad("safe: 0", "safe: 0, channel: 1"),
            "b.yaml:2: reference.channel is not known here. Known: device, min, max, safe, safe_because, rate");
  EXPECT_THAT(bad("      omega: {range: [-600, 600], noise: 0.3, correlation: 0.5}\n",
                  "      omega: {range: [-600, 600]}\n      i_a: {range: [-5, 5]}\n"),
              HasSubstr("b.yaml:9: devices.meter measures i_a, but so does daq i_a"));
  EXPECT_EQ(
      bad("simulation:\n  pace: max\n  motor: {R_a: 1.2, K_b: 0.042, K_m: 0.042, J: 6.0e-5}\n"
          "  friction: {law: hard, T_c: 0.003}\n",
          ""),
      "b.yaml:5: devices.daq.driver is simulated_daq, which needs the plant. Write a `simulation:` block at the end "
      "of the file");
}

TEST(Registry, TheSimulationIsCheckedStrictly) {
  EXPECT_EQ(
      bad("J: 6.0e-5", "j: 6.0e-5"),
      "b.yaml:11: simulation.motor.j is not known here. Known: R_a, L_a, K_b, K_m, B, J, brush_drop, "
      "brush_current, heat_capacity, heat_resistance, reaction, reaction_current, field_drop, field_time, "
      "flux_hysteresis, coercive_current, windage, windage_exponent, windage_omega, bearing_drag, bearing_exponent");
  EXPECT_EQ(bad("R_a: 1.2", "R_a: 0"), "b.yaml:11: simulation.motor.R_a is 0, but must be above 0");
  EXPECT_EQ(bad(", J: 6.0e-5", ""), "b.yaml:11: simulation.motor.J is missing");
  EXPECT_EQ(bad("law: hard", "law: soft"), "b.yaml:12: simulation.friction.law is `soft`. Known: bristle, hard");
  EXPECT_EQ(bad("T_c: 0.003", "T_c: -0.003"), "b.yaml:12: simulation.friction.T_c is -0.003, but must be 0 or more");
  EXPECT_EQ(bad("pace: max", "pace: fast"), "b.yaml:10: simulation.pace must be a number, not `fast`");
  EXPECT_EQ(
      bad("pace: max", "pase: max"),
      "b.yaml:10: simulation.pase is not known here. Known: pace, process, seed, laws, driver, motor, friction, shaft, "
      "load, sensors");
  EXPECT_EQ(bad("  friction:", "  driver: {min: 3, max: 2}\n  friction:"),
            "b.yaml:12: simulation.driver.max leaves no voltage. Write a max above min");
}

TEST(Registry, AUserCanHideAnyEffectInTheSimulatedBench) {
  const std::string text =
      good +
      "  laws: other\n"
      "  driver: {gain: 4, offset: 0.1, lag: 0.01, delay: 0.002, sampling: 1.0e-3, play: 0.05, one_quadrant: true, "
      "coasts: true}\n"
      "  shaft: {cogging: 0.01, cogging_order: 8, stiffness: 0.5, J_2: 2.0e-5, gap: 0.1}\n"
      "  load: {brake: 0.005, eccentric: 0.004, spring: 0.02, spring_torque: -0.01, eddy_torque: 0.02, eddy_heating: "
      "1.0e-3}\n"
      "  sensors: {tacho_lag: 0.01, ripple: 0.02, ripple_order: 6, tacho_stick: 2, torque_lag: 0.016}\n";
  const BenchConfig bench = config(text);
  const simulated::PlantParameters plant = simulated::read_plant(*bench.simulation);
  EXPECT_EQ(plant.laws, simulated::Laws::other);
  EXPECT_EQ(plant.driver.delay, 0.002);
  EXPECT_TRUE(plant.driver.one_quadrant);
  EXPECT_TRUE(plant.driver.coasts);
  EXPECT_EQ(plant.shaft.cogging_order, 8);
  EXPECT_EQ(plant.shaft.gap, 0.1);
  EXPECT_EQ(plant.load.brake, 0.005);
  EXPECT_EQ(plant.load.spring, 0.02);
  EXPECT_EQ(plant.load.spring_torque, -0.01);
  EXPECT_EQ(plant.load.eddy_heating, 1e-3);
  EXPECT_EQ(plant.sensors.ripple, 0.02);
  EXPECT_EQ(plant.sensors.torque_lag, 0.016);
  const simulated::Plant runs(plant);
  EXPECT_EQ(runs.omega(), 0);
}

TEST(Registry, GearsAndBearingsMayRubInTheSimulatedBench) {
  std::string text = good;
  const std::string motor = "J: 6.0e-5}", friction = "T_c: 0.003}";
  text.replace(text.find(motor), motor.size(), "J: 6.0e-5, bearing_drag: 4.0e-5, bearing_exponent: 0.6}");
  text.replace(text.find(friction), friction.size(), "T_c: 0.003, gears: 0.1}");
  const BenchConfig bench = config(text);
  const simulated::PlantParameters plant = simulated::read_plant(*bench.simulation);
  EXPECT_EQ(plant.motor.bearing_drag, 4e-5);
  EXPECT_EQ(plant.motor.bearing_exponent, 0.6);
  EXPECT_EQ(plant.friction.gears, 0.1);
  EXPECT_EQ(bad("law: hard, T_c: 0.003", "gears: 0.1"),
            "b.yaml:12: simulation.friction.gears needs dry friction. Write a T_c above 0");
}

TEST(Registry, WhatCannotBeHiddenTogetherIsSaid) {
  const auto complaint = [](const std::string& line) { return bad("  friction:", "  " + line + "\n  friction:"); };
  EXPECT_EQ(complaint("laws: mine"), "b.yaml:12: simulation.laws is `mine`. Known: usual, other");
  EXPECT_EQ(complaint("shaft: {gap: 0.1}"),
            "b.yaml:12: simulation.shaft.gap needs a compliant shaft. Add stiffness and J_2");
  EXPECT_EQ(complaint("shaft: {stiffness: 1, J_2: 1}"),
            "b.yaml:12: simulation.shaft.J_2 is not below motor.J, of which it is a part");
  EXPECT_EQ(complaint("sensors: {lag: 1}"),
            "b.yaml:12: simulation.sensors.lag is not known here. Known: tacho_lag, ripple, ripple_second, "
            "ripple_order, ripple_phase, tacho_stick, delay, torque_lag, supply");
}

TEST(Registry, TheInstrumentsAreCheckedStrictly) {
  EXPECT_EQ(
      bad("omega: {", "speed: {"),
      "b.yaml:7: devices.daq.channels.speed cannot be measured here. The simulated plant has u_ref, e_a, i_a, omega, "
      "theta, torque");
  EXPECT_EQ(bad("range: [-600, 600]", "range: [600, -600]"),
            "b.yaml:7: devices.daq.channels.omega.range must be [lowest, highest] in rad/s");
  EXPECT_EQ(bad("correlation: 0.5", "correlation: 1"),
            "b.yaml:7: devices.daq.channels.omega.correlation is 1, but must be 0 to 0.9999");
  EXPECT_EQ(bad("noise: 0.3", "bits: 12.5"), "b.yaml:7: devices.daq.channels.omega.bits must be a whole number");
  EXPECT_EQ(bad("period: 0.4", "period: 0.4, window: 0.5"),
            "b.yaml:8: devices.meter.window is 0.5, but must be 0.001 to 0.4");
  EXPECT_EQ(bad("period: 0.4", "signal: omega"),
            "b.yaml:8: devices.meter.signal is `omega`, but the simulated meter sits in the armature circuit: i_a");
  EXPECT_EQ(bad("period: 0.4", "rate: 2.5"),
            "b.yaml:8: devices.meter.rate is not known here. Known: driver, signal, period, window, resolution, noise, "
            "offset, latency, reads");
  EXPECT_EQ(bad("period: 0.4", "reads: peak"), "b.yaml:8: devices.meter.reads is `peak`. Known: mean, rms");
}

TEST(Registry, ARealMeterKeepsItsOwnTime) {
  EXPECT_EQ(bad("{driver: simulated_meter, period: 0.4}", "{driver: serial_meter, port: x, model: fluke_45}"),
            "b.yaml:8: devices.meter.driver is serial_meter, a real device, whose time cannot be hurried. Let "
            "simulation.pace be 1");
}

TEST(Registry, TheClockGoesByThePace) {
  EXPECT_TRUE(dynamic_cast<MonotonicClock*>(open_bench(shipped("fh2-simulated")).clock.get()));
  const Bench bench = open_bench(config(good));
  const auto* paced = dynamic_cast<simulated::PacedClock*>(bench.clock.get());
  ASSERT_TRUE(paced);
  EXPECT_EQ(paced->pace(), simulated::PacedClock::as_fast_as_possible);
}

/// One run of a profile on a shipped bench, as fast as possible. The readings of each signal.
std::map<Signal, std::vector<Reading>> record(const BenchConfig& bench_config, const Profile& profile) {
  std::string text = bench_config.text;
  text.replace(text.find("pace: 1"), 7, "pace: max");
  const Bench bench = open_bench(config(text));
  std::map<Signal, std::vector<Reading>> runs;
  for (const auto& input : bench.inputs) input->start();
  const double start = bench.clock->now();
  for (int n = 0; n <= std::lround(profile.duration() * bench_config.rate); ++n) {
    const double t = n / bench_config.rate;
    bench.clock->sleep_until(start + t);
    EXPECT_EQ(bench.reference->set(profile.reference(t)), Fault::none);
    std::array<Reading, 16> out{};
    for (const auto& input : bench.inputs) {
      const Readings got = input->read(out);
      EXPECT_EQ(got.fault, Fault::none);
      for (std::size_t k = 0; k < got.count; ++k) runs[out[k].signal].push_back(out[k]);
    }
  }
  return runs;
}

double mean(const std::vector<Reading>& readings, double t0, double t1) {
  double sum = 0;
  int count = 0;
  for (const Reading& reading : readings) {
    const double t = reading.time - readings.front().time;
    if (t < t0 || t > t1) continue;
    sum += reading.value;
    ++count;
  }
  return sum / count;
}

TEST(ShippedBenches, Fh2ShowsThePapersNoLoadLoss) {
  const auto runs =
      record(shipped("fh2-simulated"), read_profile(EMTB_SOURCE_DIR "/config/profiles/fh2_step_high.yaml"));
  EXPECT_EQ(runs.at(Signal::omega).size(), 30'001U);
  EXPECT_EQ(runs.at(Signal::i_a).size(), 75U);
  // K_m i = B omega + T_c and e_a = R_a i + K_b omega, settled at 110 V
  const double omega = (110 - 31.825 * 0.0547 / 0.6739) / (0.6739 + 31.825 * 1e-4 / 0.6739);
  EXPECT_NEAR(mean(runs.at(Signal::omega), 10, 15), omega, 0.05);
  EXPECT_NEAR(mean(runs.at(Signal::e_a), 10, 15), 110, 0.05);
  EXPECT_NEAR(mean(runs.at(Signal::i_a), 10, 15), (0.0547 + 1e-4 * omega) / 0.6739, 5e-4);
  EXPECT_NEAR(mean(runs.at(Signal::omega), 26, 30), 0, 0.02);
  EXPECT_NEAR(mean(runs.at(Signal::u_ref), 3, 15), 6, 0.005);
}

TEST(ShippedBenches, NoRunOfADeskMeetsItsLimits) {
  const BenchConfig desk = shipped("desk-simulated");
  for (const std::string name : {"step_low", "step_mid", "step_high", "ramp", "staircase", "random"}) {
    const auto runs = record(desk, read_profile(EMTB_SOURCE_DIR "/config/profiles/desk_" + name + ".yaml"));
    for (const auto& [signal, limit] : {std::pair{Signal::i_a, desk.limits.i_a},
                                        {Signal::omega, desk.limits.omega},
                                        {Signal::torque, desk.limits.torque}}) {
      double most = 0;
      for (const Reading& reading : runs.at(signal)) most = std::max(most, std::abs(reading.value));
      EXPECT_LT(most, 0.95 * limit.value()) << name << " " << info(signal).name;
    }
  }
}

TEST(ShippedBenches, NoRunOfTheFh2MeetsItsLimits) {
  const BenchConfig fh2 = shipped("fh2-simulated");
  for (const std::string name : {"step_low", "step_mid", "step_high", "ramp", "staircase", "random"}) {
    const Profile profile = read_profile(EMTB_SOURCE_DIR "/config/profiles/fh2_" + name + ".yaml");
    const auto runs = record(fh2, profile);
    EXPECT_LT(profile.duration(), fh2.limits.time.value());
    for (const auto& [signal, limit] : {std::pair{Signal::i_a, fh2.limits.i_a},
                                        {Signal::omega, fh2.limits.omega},
                                        {Signal::torque, fh2.limits.torque}}) {
      double most = 0;
      for (const Reading& reading : runs.at(signal)) most = std::max(most, std::abs(reading.value));
      EXPECT_LT(most, 0.95 * limit.value()) << name << " " << info(signal).name;
    }
  }
}

}  // namespace
}  // namespace emtb
