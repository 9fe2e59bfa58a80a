#include "session/session.h"

#include <algorithm>

namespace emtb {

double Run::duration() const {
  double last = 0;
  for (const auto& [signal, series] : signals) {
    if (!series.t.empty()) last = std::max(last, series.t.back());
  }
  return last;
}

void share_times(std::map<Signal, Series>& signals) {
  for (auto series = signals.begin(); series != signals.end(); ++series) {
    for (auto before = signals.begin(); before != series; ++before) {
      if (series->second.t.share(before->second.t)) break;
    }
  }
}

std::size_t most_readings(const Run& run) {
  std::size_t most = 0;
  for (const auto& [signal, series] : run.signals) most = std::max(most, series.t.size());
  return most;
}

bool is_sparse(const Run& run, Signal signal) { return 2 * run.at(signal).t.size() < most_readings(run); }

double window_start(const Series& series, std::size_t k) {
  const auto& t = series.t;
  if (series.window > 0) return t[k] - series.window;
  if (k > 0) return t[k - 1];
  return t.size() > 1 ? std::max(0.0, t[0] - (t[1] - t[0])) : 0;
}

}  // namespace emtb
