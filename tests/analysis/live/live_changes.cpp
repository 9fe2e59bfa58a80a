// How often the live misfit notices and names what changes in mid run, over many seeds, and how often it is wrong on a
// healthy motor, on both simulated benches:
//
//     build/release/bin/live_changes changes FIRST LAST [NOISE_CORRELATION]     seeds from FIRST to LAST
//     build/release/bin/live_changes healthy MINUTES [NOISE_CORRELATION [SEED]] simulated minutes of each bench
//
// Runs of other seeds add up, so that a count can be made in parts. The numbers of docs/decisions/live-estimates.md
// stand there with their commands. Behind each count its 95 % interval (Clopper and Pearson 1934).

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

#include "tests/analysis/live/live_bench.h"

namespace {

using namespace emtb;
using namespace emtb::live_bench;

/// P(at most k of n) where each comes with probability p.
double binomial(int k, int n, double p) {
  double sum = 0;
  for (int i = 0; i <= k; ++i) {
    sum += std::exp(std::lgamma(n + 1) - std::lgamma(i + 1) - std::lgamma(n - i + 1) + i * std::log(p) +
                    (n - i) * std::log1p(-p));
  }
  return sum;
}

template <class Below>
double bisect(double low, double high, const Below& below) {
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (below(middle) ? low : high) = middle;
  }
  return low;
}

std::string interval(int k, int n) {
  const double low = k == 0 ? 0 : bisect(0, 1, [&](double p) { return 1 - binomial(k - 1, n, p) < 0.025; });
  const double high = k == n ? 1 : bisect(0, 1, [&](double p) { return binomial(k, n, p) > 0.025; });
  char text[64];
  std::snprintf(text, sizeof text, "%3d of %3d (%.0f-%.0f %%)", k, n, 100 * low, 100 * high);
  return text;
}

/// Of a count in a Poisson process.
std::string rate_interval(int k, double hours) {
  const auto at_most = [](int most, double mean) {
    double sum = 0;
    for (int i = 0; i <= most; ++i) sum += std::exp(i * std::log(mean) - mean - std::lgamma(i + 1));
    return sum;
  };
  const double low = k == 0 ? 0 : bisect(0, 1e3, [&](double m) { return 1 - at_most(k - 1, m) < 0.025; });
  const double high = bisect(0, 1e3, [&](double m) { return at_most(k, m) > 0.025; });
  char text[96];
  std::snprintf(text, sizeof text, "%d in %.2f h: %.2f an hour (%.2f-%.2f)", k, hours, k / hours, low / hours,
                high / hours);
  return text;
}

void count_changes(const char* what, LiveBench bench, const MotorChange& change, int first, int last, double rho) {
  bench.colour_tacho(rho);
  int early = 0, noticed = 0, named = 0, best = 0, sized = 0, all = 0;
  double latest = 0, mean = 0;
  for (int seed = first; seed <= last; ++seed) {
    ++all;
    LiveEstimator estimator(bench.model, bench.channels(), bench.setup.rate);
    std::vector<LiveChange> told;
    feed(estimator, changed_run(bench, change, static_cast<std::uint64_t>(seed)), [&](Signal signal, double, double&) {
      if (signal == Signal::u_ref) std::ranges::move(estimator.news(), std::back_inserter(told));
      return true;
    });
    const auto report = estimator.estimates().misfit;
    std::erase_if(told, [&](const LiveChange& c) {
      if (c.noticed < change.visible) ++early, std::printf("    seed %d: early: %s\n", seed, describe(c).c_str());
      return c.noticed < change.visible;
    });
    if (told.empty() || told.front().noticed > change.visible + 5) {
      std::printf("    seed %d: %s\n", seed, told.empty() ? "nothing" : describe(told.front()).c_str());
      continue;
    }
    ++noticed;
    mean += told.front().noticed - change.visible;
    latest = std::max(latest, told.front().noticed - change.visible);
    const auto& suspects = told.front().suspects;
    const auto found = std::ranges::find(suspects, change.name, &LiveSuspect::name);
    if (found == suspects.end()) {
      std::printf("    seed %d: %s\n", seed, describe(told.front()).c_str());
      continue;
    }
    ++named;
    best += found == suspects.begin() ? 1 : 0;
    for (const LiveChange& c : report.changes) {
      if (c.noticed != told.front().noticed) continue;
      const auto later = std::ranges::find(c.suspects, change.name, &LiveSuspect::name);
      if (later == c.suspects.end()) continue;
      if (std::abs(later->change - change.size) <= 0.15 * change.size) ++sized;
      if (seed == first) std::printf("    seed %d: %s\n", seed, describe(c).c_str());
    }
  }
  std::printf(
      "%-24s rho %.2f  within 5 s %s  named %d, first of its tie %d, size within 15 %% %d  after %.1f s (worst %.1f)  "
      "early %d\n",
      what, rho, interval(noticed, all).c_str(), named, best, sized, noticed > 0 ? mean / noticed : 0, latest, early);
  std::fflush(stdout);
}

/// The same levels, jumps of more than `most` [V] by way of zero for half a second: what the bench's limit of the
/// current allows.
Profile in_smaller_jumps(const Profile& profile, double most) {
  constexpr double on_the_way = 0.5;  // [s]
  std::vector<Knot> knots;
  double later = 0;  // [s]
  for (const Knot& knot : profile.knots()) {
    const bool jump =
        !knots.empty() && knots.back().t == knot.t + later && std::abs(knots.back().value - knot.value) > most;
    if (jump) {
      knots.push_back({knot.t + later, 0});
      later += on_the_way;
      knots.push_back({knot.t + later, 0});
    }
    knots.push_back({knot.t + later, knot.value});
  }
  return Profile(std::string(profile.name()), knots);
}

void count_alarms(const char* what, LiveBench bench, double minutes, double rho, int seed) {
  bench.colour_tacho(rho);
  const bool servo = bench.setup.plant.driver.min < 0;
  LiveEstimator estimator(bench.model, bench.channels(), bench.setup.rate);
  int alarms = 0;
  double seconds = 0;
  std::uint64_t samples = 0;
  const int runs = std::max(1, static_cast<int>(std::lround(minutes / 2)));
  for (int k = 0; k < runs; ++k) {
    const auto run_seed = static_cast<std::uint64_t>(1000 * seed + k);
    const Profile profile =
        in_smaller_jumps(random_steps("random", servo ? -5 : 0, servo ? 5 : 6, 1, 15, 2, 114, 4, run_seed), 6);
    const Run run = simulated::record(bench.setup, profile, run_seed);
    const auto start = std::chrono::steady_clock::now();
    feed(estimator, run);
    seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    for (const LiveChange& c : estimator.news()) {
      ++alarms;
      std::printf("    %s, run %d: %s\n", what, k, describe(c).c_str());
    }
    samples = estimator.estimates().samples;
  }
  std::printf("%-24s rho %.2f  false alarms %s   %.2f us a sample\n", what, rho,
              rate_interval(alarms, runs / 30.0).c_str(), 1e6 * seconds / static_cast<double>(samples));
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view what = argc > 1 ? argv[1] : "";
  const auto number = [&](int i, double otherwise) { return argc > i ? std::atof(argv[i]) : otherwise; };
  if (what == "changes") {
    const int first = static_cast<int>(number(2, 1)), last = static_cast<int>(number(3, 20));
    const double rho = number(4, 0);
    const LiveBench slow = slow_live_bench(), fast = fast_live_bench();
    count_changes("FH2 R_a +10 %, loaded", loaded(slow), hotter(slow, 0.1), first, last, rho);
    count_changes("FH2 brake 0.02 N m", slow, braked(0.02), first, last, rho);
    count_changes("FH2 friction +0.02 N m", slow, rubbing(0.02), first, last, rho);
    count_changes("FH2 J +20 %", slow, heavier(slow, 0.2), first, last, rho);
    count_changes("desk R_a +10 %, loaded", loaded(fast), hotter(fast, 0.1), first, last, rho);
    count_changes("desk J +20 %", fast, heavier(fast, 0.2), first, last, rho);
  } else if (what == "healthy") {
    const double minutes = number(2, 60), rho = number(3, 0);
    const int seed = static_cast<int>(number(4, 1));
    count_alarms("FH2", slow_live_bench(), minutes, rho, seed);
    count_alarms("FH2, loaded", loaded(slow_live_bench()), minutes, rho, seed);
    count_alarms("desk", fast_live_bench(), minutes, rho, seed);
    count_alarms("desk, loaded", loaded(fast_live_bench()), minutes, rho, seed);
  } else {
    std::fputs(
        "live_changes: what? changes FIRST LAST [NOISE_CORRELATION], or healthy MINUTES [NOISE_CORRELATION [SEED]]\n",
        stderr);
    return 2;
  }
}
