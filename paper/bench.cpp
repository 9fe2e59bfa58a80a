#include "paper/bench.h"

#include <array>

#include "config/bench.h"
#include "config/shipped.h"

namespace emtb::paper {
namespace {

constexpr double rate = 250;  // [Hz]

// One seed an experiment: each has noise of its own, and none changes when another is added.
enum Seed : std::uint64_t {
  raise = 4,
  lower = 5,
  brake = 6,
  contactor = 7,
  driver = 8,
  coast = 9,
  rising = 11,
  falling = 12
};

constexpr std::array levels{0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 5.5, 6.0};  // [V]

}  // namespace

simulated::Setup fh2() {
  simulated::Setup setup = simulated::read_setup(read_bench(shipped("benches/fh2-simulated.yaml")));
  setup.rate = rate;
  return setup;
}

simulated::Setup with_gauge_gain(simulated::Setup setup, double gain) {
  setup.plant.motor.B /= gain;
  setup.plant.motor.J /= gain;
  setup.plant.friction.T_c /= gain;
  for (simulated::DaqChannel& channel : setup.channels) {
    if (channel.signal == Signal::torque) channel.gain = gain;
  }
  return setup;
}

simulated::Setup with_fast_ammeter(simulated::Setup setup) {
  setup.meter.reset();
  setup.channels.push_back({.signal = Signal::i_a, .low = -5, .high = 5, .noise = 0.005});
  return setup;
}

simulated::Setup rectified(simulated::Setup setup, double crest) {
  setup.plant.driver.rectified = 49.9;  // mains are never in step with a card
  setup.plant.driver.crest = crest;
  setup.meter->rms = true;
  for (simulated::DaqChannel& channel : setup.channels) {
    if (channel.signal == Signal::e_a) channel.low = -400, channel.high = 400;  // for the crests
  }
  setup.rate = 1000;
  return setup;
}

simulated::LoadParameters brake_of_figure_5() { return {.torque = 0, .eddy_torque = 0.1010, .eddy_omega = 118.6}; }

Run raise_voltage(const simulated::Setup& setup) {
  return record(setup, staircase("raise_voltage", levels, 1, 5, 1), raise);
}

Run lower_voltage(const simulated::Setup& setup, const simulated::LoadParameters& load) {
  constexpr double hold = 5;
  std::vector<Knot> knots{{0, printed::reference}, {10, printed::reference}};
  for (double u = 5.5; u > 2.6; u -= 0.5) {
    knots.push_back({knots.back().t, u});
    knots.push_back({knots.back().t + hold, u});
  }
  const std::vector<simulated::Operation> operations{{5, [&](simulated::Plant& plant) { plant.set_load(load); }}};
  return record(setup, Profile("lower_voltage", std::move(knots)), lower, operations);
}

Run turn_up_brake(const simulated::Setup& setup, double reference) {
  constexpr double start = 8, hold = 4;
  constexpr int settings = 10;
  std::vector<simulated::Operation> operations;
  for (int n = 1; n <= settings; ++n) {
    operations.push_back({start + hold * n, [n](simulated::Plant& plant) {
                            plant.set_load({.torque = 0, .eddy_torque = 0.05 * n, .eddy_omega = 100});
                          }});
  }
  const Profile profile("turn_up_brake", {{0, reference}, {start + hold * (settings + 1), reference}});
  return record(setup, profile, brake, operations);
}

Run close_contactor(const simulated::Setup& setup) {
  simulated::Setup past_the_driver = setup;
  past_the_driver.plant.driver.rise = past_the_driver.plant.driver.fall = simulated::unlimited;
  past_the_driver.rate = 1000;  // it is over in a second
  return record(past_the_driver, step("close_contactor", printed::reference, 0.4, 3.2, 0), contactor);
}

Run open_armature(const simulated::Setup& setup) {
  constexpr double opened = 9;
  const std::vector<simulated::Operation> operations{
      {opened, [](simulated::Plant& plant) { plant.open_armature(true); }}};
  return record(setup, step("open_armature", printed::reference, 0, opened, 12), coast, operations);
}

Run step_up(const simulated::Setup& setup) {
  return record(setup, step("step_up", printed::reference, 1, 11, 0), rising);
}

Run step_up_and_down(const simulated::Setup& setup) {
  return record(setup, step("step_up_and_down", printed::reference, 1, 11, 11), falling);
}

std::vector<Run> driver_steps(const simulated::Setup& setup) {
  std::vector<Run> runs;
  for (const auto& [name, level] :
       {std::pair{"step to 2 V", 2.0}, std::pair{"step to 4 V", 4.0}, std::pair{"step to 6 V", 6.0}}) {
    runs.push_back(record(setup, step(name, level, 1, 8, 8), driver));
  }
  return runs;
}

}  // namespace emtb::paper
