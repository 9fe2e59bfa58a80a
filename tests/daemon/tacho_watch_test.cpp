#include "daemon/tacho_watch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "config/profile.h"
#include "drivers/simulated/recording.h"

namespace emtb {
namespace {

const std::filesystem::path shipped_files(EMTB_CONFIG);

/// Feeds a run to the watch in the order in which its readings arrive, a meter's `delay` [s] late.
Fault judged(const Run& run, const BenchConfig& bench, double delay = 0) {
  struct Arrival {
    double t;
    Reading reading;
    double window;
  };
  std::vector<Arrival> arrivals;
  for (const Signal signal : {Signal::e_a, Signal::omega, Signal::i_a}) {
    const Series& series = run.at(signal);
    for (std::size_t k = 0; k < series.t.size(); ++k) {
      const double late = signal == Signal::i_a ? delay : 0;
      arrivals.push_back({series.t[k] + late, {signal, 1000 + series.t[k], series.value[k], k}, series.window});
    }
  }
  std::ranges::stable_sort(arrivals, {}, &Arrival::t);
  auto watch = std::make_unique<TachoWatch>(*bench.tacho, *bench.motor.R_a);
  for (const Arrival& arrival : arrivals) {
    if (const Trip trip = watch->take(arrival.reading, arrival.window)) return trip.fault;
  }
  return Fault::none;
}

struct WatchedBench {
  explicit WatchedBench(const std::string& name)
      : bench(read_bench(shipped_files / "benches" / (name + ".yaml"))), setup(simulated::read_setup(bench)) {}
  Run record(const std::string& profile) const {
    return simulated::record(setup, read_profile(YamlMap::load(shipped_files / "profiles" / (profile + ".yaml"))), 7);
  }
  BenchConfig bench;
  simulated::Setup setup;
};

void change(Run& run, const std::function<double(double)>& tacho) {
  for (double& value : run.signals.at(Signal::omega).value.edit()) value = tacho(value);
}

TEST(TachoWatch, AHealthyBenchNeverTripsIt) {
  for (const char* name : {"fh2", "desk"}) {
    const WatchedBench bench(std::string(name) + "-simulated");
    for (const char* profile : {"step_low", "step_mid", "step_high", "ramp", "staircase", "random"}) {
      const emtb::Run run = bench.record(std::string(name) + "_" + profile);
      EXPECT_EQ(judged(run, bench.bench), Fault::none) << name << " " << profile;
      EXPECT_EQ(judged(run, bench.bench, 0.3), Fault::none) << name << " " << profile << ", the meter late";
    }
  }
}

TEST(TachoWatch, ADeadTachoIsSeenWithASlowMeterAndWithAFastOne) {
  for (const char* name : {"fh2", "desk"}) {
    const WatchedBench bench(std::string(name) + "-simulated");
    emtb::Run run = bench.record(std::string(name) + "_step_mid");
    change(run, [](double) { return 0.3; });  // the noise of an open input
    EXPECT_EQ(judged(run, bench.bench), Fault::dead_tacho) << name;
    EXPECT_EQ(judged(run, bench.bench, 0.3), Fault::dead_tacho) << name << ", the meter late";
  }
}

TEST(TachoWatch, AReversedTachoIsSeen) {
  for (const char* name : {"fh2", "desk"}) {
    const WatchedBench bench(std::string(name) + "-simulated");
    emtb::Run run = bench.record(std::string(name) + "_step_mid");
    change(run, [](double omega) { return -omega; });
    EXPECT_EQ(judged(run, bench.bench), Fault::reversed_tacho) << name;
  }
}

TEST(TachoWatch, AMotorHeldByStictionDoesNotFoolIt) {
  WatchedBench bench("fh2-simulated");
  bench.setup.plant.friction.T_c = 1.2;  // [N m] holds against 57 V
  const emtb::Run held = bench.record("fh2_step_low");
  ASSERT_LT(*std::ranges::max_element(held.at(Signal::omega).value), 2);
  ASSERT_GT(*std::ranges::max_element(held.at(Signal::e_a).value), 30) << "volts enough to look like 20 V of back-EMF";
  EXPECT_EQ(judged(held, bench.bench), Fault::none);

  bench.setup.meter->rms = true;  // a meter that reads too much while the rectifier pulses
  bench.setup.plant.driver.crest = 0.4;
  EXPECT_EQ(judged(bench.record("fh2_step_low"), bench.bench), Fault::none);
}

TEST(TachoWatch, ForgetsWhatWasBeforeARestart) {
  const WatchedBench bench("desk-simulated");
  TachoWatch watch(*bench.bench.tacho, *bench.bench.motor.R_a);
  const auto dead = [&](double from) {
    Trip last;
    for (int n = 0; n < 900; ++n) {
      const double t = from + 1e-3 * n;
      watch.take({Signal::e_a, t, 20, 0}, 0);
      watch.take({Signal::omega, t, 0, 0}, 0);
      last = watch.take({Signal::i_a, t, 1, 0}, 0);
    }
    return last.fault;
  };
  EXPECT_EQ(dead(10), Fault::none) << "not long enough yet";
  watch.restart();
  EXPECT_EQ(dead(10.9), Fault::none) << "it begins anew";
  EXPECT_EQ(dead(11.8), Fault::dead_tacho);
}

}  // namespace
}  // namespace emtb
