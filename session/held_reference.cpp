#include "session/held_reference.h"

#include <algorithm>
#include <array>
#include <vector>

namespace emtb {
namespace {

/// The times of all signals together, from one on.
std::vector<double> all_times(const Run& run, double from) {
  constexpr double same = 1e-7;  // [s]
  std::vector<double> times;
  for (const auto& [signal, series] : run.signals) times.insert(times.end(), series.t.begin(), series.t.end());
  std::ranges::sort(times);
  std::vector<double> distinct;
  for (const double t : times) {
    if (t >= from && (distinct.empty() || t - distinct.back() > same)) distinct.push_back(t);
  }
  return distinct;
}

/// Is it written clearly less often than something is read?
bool is_seldom(const Run& run, Signal signal) {
  constexpr double about_as_often = 0.8;
  return static_cast<double>(run.at(signal).t.size()) < about_as_often * static_cast<double>(most_readings(run));
}

void hold(Run& run, Signal signal) {
  const Series written = run.at(signal);
  Series held = written;
  std::vector<double> values;
  std::vector<double> times = all_times(run, written.t.front());
  std::size_t last = 0;
  for (const double t : times) {
    while (last + 1 < written.t.size() && written.t[last + 1] <= t) ++last;
    values.push_back(written.value[last]);
  }
  held.t = std::move(times);
  held.value = std::move(values);
  run.signals.at(signal) = std::move(held);
}

}  // namespace

void hold_references(std::span<Run> runs) {
  for (Run& run : runs) {
    for (const Signal signal : std::array{Signal::u_ref, Signal::armature_open}) {
      if (run.has(signal) && !run.at(signal).t.empty() && is_seldom(run, signal)) hold(run, signal);
    }
  }
}

}  // namespace emtb
