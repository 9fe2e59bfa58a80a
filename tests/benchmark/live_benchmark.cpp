// What a tick costs the live estimator: 1 kHz, speed, voltage and torque at every tick, a meter at 2.5 Hz; five
// parameters and three effects. With the model's values far off (the history is followed anew again and again) and
// about right.
//
//     build/release/bin/live_benchmark
//
// `tick` is the mean over a minute, `worst_ms` the longest millisecond of the run, work that comes in one piece
// included.

#include <benchmark/benchmark.h>

#include <chrono>

#include "tests/analysis/live/live_bench.h"

namespace emtb {
namespace {

using namespace live_bench;

void live(benchmark::State& state, double off) {
  LiveBench bench = slow_live_bench();
  bench.model.tie.clear();  // K_b and K_m each
  bench.model.include(effect_index("windage"));
  bench.model.include(effect_index("tacho_offset"));
  if (off == 0) {
    for (Parameter& p : bench.model.base) p.value = bench.truth.at(p.symbol == "K_m" ? "K_b" : p.symbol);
  } else {
    bench.model.base[base::K_m] = bench.model.base[base::K_b];
    bench.model.base[base::K_m].symbol = "K_m";
  }
  if (off == 0) {
    bench.model.base[base::K_m].min = 0.1;
    bench.model.base[base::K_m].max = 2;
  }
  const emtb::Run run = simulated::record(bench.setup, bench.staircase, 1);
  const auto ticks = static_cast<double>(run.at(Signal::u_ref).t.size());
  double worst = 0;
  for (auto _ : state) {
    LiveEstimator estimator(bench.model, bench.channels(), bench.setup.rate);
    auto before = std::chrono::steady_clock::now();
    feed(estimator, run, [&](Signal signal, double, double&) {
      if (signal == Signal::u_ref) {
        const auto now = std::chrono::steady_clock::now();
        worst = std::max(worst, std::chrono::duration<double>(now - before).count());
        before = now;
      }
      return true;
    });
    benchmark::DoNotOptimize(estimator.estimates());
  }
  state.counters["tick"] =
      benchmark::Counter(ticks, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  state.counters["worst_ms"] = 1e3 * worst;
}

BENCHMARK_CAPTURE(live, about_right, 0.0)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(live, far_off, 1.0)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace emtb
