// How often the live estimator's +-2 standard errors cover the truth, over many seeds of both simulated benches:
//
//     build/release/bin/live_coverage [once] [SEEDS] [NOISE_CORRELATION ...]
//
// `once`: the history is never followed anew, as a plain recursion would have it.
//
// The numbers of docs/decisions/live-estimates.md come from `live_coverage 100 0 0.97` and `live_coverage once 10 0`.

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "tests/analysis/live/live_bench.h"

namespace {

using namespace emtb;
using namespace emtb::live_bench;

void table(const char* name, LiveBench bench, int seeds, double rho, const LiveEstimator::Options& options) {
  bench.colour_tacho(rho);
  struct Row {
    int covered = 0;
    double error = 0, squares = 0, claimed = 0;
  };
  std::map<std::string, Row> rows;
  double seconds = 0;
  std::uint64_t samples = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    const Run run = simulated::record(bench.setup, bench.staircase, static_cast<std::uint64_t>(seed));
    LiveEstimator estimator(bench.model, bench.channels(), bench.setup.rate, options);
    const auto start = std::chrono::steady_clock::now();
    feed(estimator, run);
    seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const LiveEstimates e = estimator.estimates();
    samples += e.samples;
    for (const auto& [parameter_name, truth] : bench.truth) {
      Row& row = rows[parameter_name];
      const LiveParameter& p = parameter(e, parameter_name);
      row.covered += std::abs(p.value - truth) <= 2 * p.std_error ? 1 : 0;
      row.error += (p.value - truth) / seeds;
      row.squares += (p.value - truth) * (p.value - truth) / seeds;
      row.claimed += p.std_error / seeds;
      if (std::abs(p.value - truth) > 6 * p.std_error) {
        std::printf("    seed %d: %s %.6g +- %.2g (true %.6g)\n", seed, parameter_name.c_str(), p.value, p.std_error,
                    truth);
      }
      if (seeds == 1)
        std::printf("    %s %.6g +- %.2g (true %.6g)\n", parameter_name.c_str(), p.value, p.std_error, truth);
    }
    if (seeds == 1) {
      for (const auto& i : e.innovation) {
        std::printf("    %s: normalised %.3f sigma %.4g\n", std::string(info(i.signal).name).c_str(), i.normalised,
                    i.sigma);
      }
    }
  }
  for (const auto& [parameter_name, row] : rows) {
    std::printf("%-5s rho %.2f  %-22s covered %3d of %d   bias %+9.2e   rms %9.2e   claimed %9.2e\n", name, rho,
                parameter_name.c_str(), row.covered, seeds, row.error, std::sqrt(row.squares), row.claimed);
  }
  std::printf("%-5s rho %.2f  %.2f us a sample\n", name, rho, 1e6 * seconds / static_cast<double>(samples));
}

}  // namespace

int main(int argc, char** argv) {
  LiveEstimator::Options options;
  if (argc > 1 && std::string_view(argv[1]) == "once") {
    options.catch_up = 1;  // a second pass never arrives
    --argc;
    ++argv;
  }
  const int seeds = argc > 1 ? std::atoi(argv[1]) : 100;
  std::vector<double> colours;
  for (int i = 2; i < argc; ++i) colours.push_back(std::atof(argv[i]));
  if (colours.empty()) colours = {0, 0.97};
  for (const double rho : colours) {
    table("slow", slow_live_bench(), seeds, rho, options);
    table("fast", fast_live_bench(), seeds, rho, options);
    std::fflush(stdout);
  }
}
