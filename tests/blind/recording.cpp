#include "tests/blind/recording.h"

#include "drivers/simulated/recording.h"

namespace emtb::blind {
namespace {

Parameter within(const char* symbol, const char* unit, double value, double min, double max) {
  Parameter p;
  p.symbol = symbol;
  p.unit = unit;
  p.value = value;
  p.min = min;
  p.max = max;
  return p;
}

Model linear_model(const DriverModel& driver, const Parameter& r, const Parameter& k, const Parameter& b,
                   const Parameter& j) {
  Model model;
  model.name = "linear";
  model.driver = driver;
  Parameter k_m = k;
  k_m.symbol = "K_m";
  k_m.unit = "N m/A";
  model.base = {r, k, k_m, b, j};
  model.tie = {{"K_m", "K_b"}};
  return model;
}

}  // namespace

Bench slow_bench() {
  Bench bench;
  bench.plant.driver = {.gain = 110.0 / 6, .rise = 22.5, .fall = 20.4, .min = 0, .max = 110};
  bench.plant.motor = {.R_a = 31.825, .K_b = 0.6739, .K_m = 0.6739, .B = 1e-4, .J = 3.449e-3};
  bench.channels = {{.signal = Signal::e_a, .low = -130, .high = 130, .noise = 0.06},
                    {.signal = Signal::omega, .low = -200, .high = 200, .noise = 0.2},
                    {.signal = Signal::torque, .low = -2, .high = 2, .noise = 0.002}};
  bench.slow_meter = true;
  bench.rate = 250;
  const std::vector<double> levels{1, 3, 5, 6, 4, 2};
  bench.train = {step("step_low", 2, 1, 6, 6), step("step_high", 6, 1, 8, 10), ramp("ramp", 6, 0.6, 1, 3, 4),
                 random_steps("random", 0.5, 6, 1.5, 4, 1, 30, 6, 7)};
  bench.held_out = {step("step_mid", 4, 1, 8, 8), staircase("staircase", levels, 1, 4, 6)};
  bench.model = linear_model({.gain = 110.0 / 6, .rise = 22.5, .fall = 20.4, .min = 0, .max = 110},
                             within("R_a", "ohm", 30, 5, 100), within("K_b", "V s/rad", 0.6, 0.1, 2),
                             within("B", "N m s/rad", 3e-4, 0, 0.01), within("J", "kg m2", 4e-3, 2e-4, 0.1));
  return bench;
}

Bench fast_bench() {
  Bench bench;
  bench.plant.driver = {.gain = 4, .rise = 2000, .fall = 2000, .min = -24, .max = 24};
  bench.plant.motor = {.R_a = 1.2, .K_b = 0.042, .K_m = 0.042, .B = 1e-5, .J = 6e-5};
  bench.channels = {{.signal = Signal::e_a, .low = -30, .high = 30, .noise = 0.02},
                    {.signal = Signal::i_a, .low = -20, .high = 20, .bits = 14, .noise = 0.0025},
                    {.signal = Signal::omega, .low = -625, .high = 625, .noise = 0.3},
                    {.signal = Signal::torque, .low = -2, .high = 2, .noise = 0.002}};
  bench.rate = 1000;
  const std::vector<double> levels{1, 4, 2, -1, -4, -2};
  bench.train = {step("step_low", 2, 0.5, 2.5, 1), step("step_high", -5, 0.5, 2.5, 1), ramp("ramp", 5, 2.5, 0.5, 1, 1),
                 random_steps("random", -3, 3, 0.05, 0.8, 0.5, 10, 1, 7)};
  bench.held_out = {step("step_mid", 4, 0.5, 2.5, 1), staircase("staircase", levels, 0.5, 1.5, 1)};
  bench.model = linear_model({.gain = 4, .rise = 2000, .fall = 2000, .min = -24, .max = 24},
                             within("R_a", "ohm", 1, 0.2, 6), within("K_b", "V s/rad", 0.04, 0.005, 0.3),
                             within("B", "N m s/rad", 2e-5, 0, 1e-3), within("J", "kg m2", 5e-5, 5e-6, 1e-3));
  return bench;
}

Run record(const Bench& bench, const Profile& profile, std::uint64_t seed) {
  simulated::Setup setup{.plant = bench.plant, .channels = bench.channels, .meter = {}, .rate = bench.rate};
  if (bench.slow_meter) setup.meter = bench.meter;
  return simulated::record(setup, profile, seed);
}

std::vector<Run> record(const Bench& bench, const std::vector<Profile>& profiles, std::uint64_t seed) {
  std::vector<Run> runs;
  for (const Profile& profile : profiles) runs.push_back(record(bench, profile, seed++));
  return runs;
}

}  // namespace emtb::blind
