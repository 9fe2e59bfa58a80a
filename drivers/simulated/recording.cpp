#include "drivers/simulated/recording.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "drivers/simulated/manual_clock.h"
#include "drivers/simulated/open.h"
#include "drivers/simulated/output.h"
#include "drivers/simulated/world.h"
#include "hal/error.h"

namespace emtb::simulated {

Setup read_setup(const BenchConfig& bench) {
  if (!bench.simulation) throw ConfigError(bench.file.string() + ": no `simulation:` block: nothing to simulate");
  Setup setup;
  setup.plant = read_plant(*bench.simulation);
  setup.rate = bench.rate;
  for (const BenchConfig::Device& device : bench.devices) {
    if (device.driver == "simulated_daq") {
      setup.channels = read_channels(device.yaml);
    } else if (device.driver == "simulated_meter") {
      setup.meter = read_meter(device.yaml);
    } else {
      device.yaml.fail("driver", "is `" + device.driver +
                                     "`, but this bench is to be simulated: simulated_daq, "
                                     "simulated_meter");
    }
  }
  return setup;
}

Run record(const Setup& setup, const Profile& profile, std::uint64_t seed, std::span<const Operation> operations) {
  const auto clock = std::make_shared<ManualClock>();
  const auto world = std::make_shared<World>(setup.plant, clock, seed);
  const double period = 1 / setup.rate;
  std::vector<std::unique_ptr<InputDevice>> inputs;
  inputs.push_back(std::make_unique<Daq>("daq", world, setup.channels, period));
  if (setup.meter) inputs.push_back(std::make_unique<Meter>("meter", world, *setup.meter));
  Output output(world, {.min = -1e3, .max = 1e3, .safe = 0});
  Run run;
  run.name = profile.name();
  for (const auto& input : inputs) {
    input->start();
    for (const Channel& c : input->channels()) {
      Series& series = run.signals[c.signal];
      series.window = c.window;
      series.lsb = c.lsb;
      series.source = c.source;
    }
  }
  Series reference, open;
  const double start = clock->now();
  std::array<Reading, 64> readings{};
  auto operation = operations.begin();
  const auto ticks = static_cast<long>(std::floor(profile.duration() * setup.rate));
  for (long k = 0; k <= ticks; ++k) {
    const double t = static_cast<double>(k) * period;
    clock->sleep_until(start + t);
    for (const auto& input : inputs) {
      const Readings got = input->read(readings);
      for (std::size_t i = 0; i < got.count; ++i) {
        Series& series = run.signals[readings[i].signal];
        series.t.push_back(readings[i].time - start);
        series.value.push_back(readings[i].value);
      }
    }
    output.set(profile.reference(t));
    for (; operation != operations.end() && operation->t <= t; ++operation) world->operate(operation->act);
    reference.t.push_back(t);
    reference.value.push_back(profile.reference(t));
    open.t.push_back(t);
    world->look([&](double, const Plant& plant, double) { open.value.push_back(plant.armature_open() ? 1 : 0); });
  }
  if (std::ranges::count(open.value, 1.0) > 0) run.signals[Signal::armature_open] = std::move(open);
  run.signals[Signal::u_ref] = std::move(reference);
  std::erase_if(run.signals, [](const auto& entry) { return entry.second.t.empty(); });
  return run;
}

}  // namespace emtb::simulated
