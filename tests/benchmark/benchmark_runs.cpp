// Sessions for benchmarks: six runs of the simulated servo of config/benches/desk-simulated.yaml, in both directions,
// 287,000 samples at 1 kHz; with an effect hidden in its plant, or longer.
//
//     build/release/bin/benchmark_runs config/benches/desk-simulated.yaml OUT [--hide friction|two|periodic]
//                                      [--hour N] [--motors N]
//
// --hour N    one run of N seconds, of eight signals, OUT/hour.h5
// --motors N  N sessions of a production line, 12 s each, OUT/motor_NNNN.csv, whose K_b and friction scatter

#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <map>
#include <string>
#include <vector>

#include "config/bench.h"
#include "drivers/simulated/recording.h"
#include "experiment/profile.h"
#include "hal/error.h"
#include "session/spec.h"

namespace emtb {
namespace {

std::vector<Profile> six_profiles() {
  const std::vector<double> levels{1, 3, 5, 4, 2, -1, -3, -5, -4, -2, 1};
  return {random_steps("random", -3, 3, 0.05, 1.2, 1, 44, 3, 24),
          staircase("staircase", levels, 1, 4, 3),
          step("step_low", 2, 2, 40, 6),
          step("step_high", -5, 2, 40, 6),
          ramp("ramp", -5, 0.3, 2, 8, 4),
          random_steps("slow_random", -4, 4, 0.5, 4, 1, 42, 3.3, 7)};
}

void hide(const std::string& what, simulated::PlantParameters& plant) {
  if (what == "friction" || what == "two") plant.friction.T_c = 0.004;
  if (what == "two") plant.motor.windage = 1.2e-7;
  if (what == "periodic") {
    plant.friction.T_c = 0.004;
    plant.shaft.cogging = 0.004;
    plant.shaft.cogging_order = 12;
  }
}

/// A row for each tick: the card reads some picoseconds before the loop writes down what it set.
void save(const std::filesystem::path& path, Run run) {
  for (auto& [signal, series] : run.signals) {
    for (double& t : series.t.edit()) t = std::round(t * 1e6) / 1e6;
  }
  Session session;
  session.runs.push_back(std::move(run));
  write_session(path, session);
}

int run(const std::vector<std::string>& words, std::map<std::string, std::string> options) {
  const auto number = [&](const char* name) { return std::strtol(options[name].c_str(), nullptr, 10); };
  simulated::Setup setup = simulated::read_setup(read_bench(words.at(0)));
  const std::filesystem::path out = words.at(1);
  std::filesystem::create_directories(out);
  hide(options["--hide"], setup.plant);
  if (const long seconds = number("--hour"); seconds > 0) {
    setup.channels.push_back({.signal = Signal::theta, .low = -1e6, .high = 1e6, .bits = 0});
    Run hour = record(setup, random_steps("hour", -3, 3, 0.05, 1.2, 1, static_cast<double>(seconds) - 2, 1, 24), 1);
    // What the plant does not have: a field that stands, a winding that warms.
    Series field = hour.at(Signal::omega), warm = field;
    for (std::size_t k = 0; k < warm.t.size(); ++k) {
      field.value.edit()[k] = 0.5;
      warm.value.edit()[k] = 25 + 20 * (1 - std::exp(-warm.t[k] / 900));
    }
    field.lsb = warm.lsb = 0;
    hour.signals[Signal::i_f] = std::move(field);
    hour.signals[Signal::temperature] = std::move(warm);
    save(out / "hour.h5", std::move(hour));
    return 0;
  }
  if (const long motors = number("--motors"); motors > 0) {
    std::erase_if(setup.channels, [](const auto& c) { return c.signal == Signal::torque; });
    for (long i = 0; i < motors; ++i) {
      simulated::Setup one = setup;
      const double a = static_cast<double>(i * 37 % 101) / 101 - 0.5, b = static_cast<double>(i * 53 % 97) / 97 - 0.5;
      one.plant.motor.K_b *= 1 + 0.05 * a;
      one.plant.motor.K_m = one.plant.motor.K_b;
      one.plant.motor.B *= 1 + 0.4 * b;
      std::string name = std::to_string(i);
      name.insert(0, 4 - std::min<std::size_t>(4, name.size()), '0');
      save(out / ("motor_" + name + ".csv"),
           record(one, random_steps("test", -3, 3, 0.05, 0.8, 0.5, 11, 0.5, 7), static_cast<std::uint64_t>(i)));
    }
    return 0;
  }
  std::uint64_t seed = 1;
  std::erase_if(setup.channels, [](const auto& c) { return c.signal == Signal::torque; });
  for (const Profile& profile : six_profiles()) {
    save(out / (profile.name() + ".csv"), record(setup, profile, seed++));
  }
  return 0;
}

}  // namespace
}  // namespace emtb

int main(int count, char** words) try {
  std::vector<std::string> plain;
  std::map<std::string, std::string> options;
  for (int i = 1; i < count; ++i) {
    if (std::string(words[i]).starts_with("--") && i + 1 < count) {
      options[words[i]] = words[i + 1];
      ++i;
    } else {
      plain.emplace_back(words[i]);
    }
  }
  if (plain.size() != 2) {
    std::cerr << "benchmark_runs BENCH OUT [--hide friction|two|periodic] [--hour SECONDS] [--motors N]\n";
    return 2;
  }
  return emtb::run(plain, options);
} catch (const std::exception& e) {
  std::cerr << e.what() << "\n";
  return 2;
}
