#include "analysis/check/resting.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include "analysis/check/readings.h"

namespace emtb {
namespace {

template <class Is>
bool in_all(std::span<const Run> runs, Signal signal, const Is& is) {
  bool any = false;
  for (const Run& run : runs) {
    if (!run.has(signal) || run.at(signal).value.size() < 20) continue;
    any = true;
    if (!is(run.at(signal))) return false;
  }
  return any;
}

/// A series as a lag of so many rows makes it.
std::vector<double> lagged(std::vector<double> x, double rows) {
  for (std::size_t k = 1; k < x.size(); ++k) x[k] = x[k - 1] + (x[k] - x[k - 1]) / (1 + rows);
  return x;
}

/// The correlation of two signals over all runs, each about its mean in a run, squared.
class Correlation {
 public:
  void add(std::span<const double> x, std::span<const double> y) {
    const auto n = static_cast<double>(x.size());
    double sx = 0, sy = 0, xx = 0, xy = 0, yy = 0;
    for (std::size_t k = 0; k < x.size(); ++k) {
      sx += x[k], sy += y[k];
      xx += x[k] * x[k], xy += x[k] * y[k], yy += y[k] * y[k];
    }
    xx_ += xx - sx * sx / n;
    xy_ += xy - sx * sy / n;
    yy_ += yy - sy * sy / n;
  }
  double squared() const { return xx_ > 0 && yy_ > 0 ? xy_ * xy_ / (xx_ * yy_) : 0; }

 private:
  double xx_ = 0, xy_ = 0, yy_ = 0;
};

bool changes_by_a_step(const Series& series) {
  const auto [low, high] = std::ranges::minmax(series.value);
  return high - low > 0.9 * step_of(series);
}

/// Does a signal go where an input leads it, all runs taken together? A short run of few counts shows its motion by
/// nothing else; noise, however it is coloured, goes its own way.
bool follows_an_input(std::span<const Run> runs, Signal signal) {
  constexpr double clear = 0.5;
  std::vector<const Run*> changing;
  for (const Run& run : runs) {
    if (run.has(signal) && changes_by_a_step(run.at(signal))) changing.push_back(&run);
  }
  for (const Signal input : {Signal::u_ref, Signal::e_a, Signal::i_a}) {
    std::vector<const Run*> side_by_side = changing;
    std::erase_if(side_by_side,
                  [&](const Run* run) { return !run->has(input) || run->at(input).t != run->at(signal).t; });
    for (double rows = 0; rows < 2000; rows = 4 * rows + 1) {
      Correlation correlation;
      for (const Run* run : side_by_side) correlation.add(run->at(signal).value, lagged(run->at(input).value, rows));
      if (correlation.squared() > clear) return true;
    }
  }
  return false;
}

bool rest(std::span<const Run> runs, Signal signal) {
  return in_all(runs, signal, [](const Series& s) { return !moves(s); }) && !follows_an_input(runs, signal);
}

bool present(std::span<const Run> runs, Signal signal) {
  return std::ranges::any_of(runs, [&](const Run& run) { return run.has(signal); });
}

/// One value in all runs. Runs that begin as a step is made have a voltage that never changes, each its own, or, where
/// no reference says otherwise, that of the one step that was made. A current that a voltage drives changes in any run.
bool dead(std::span<const Run> runs, Signal signal) {
  std::set<double> values;
  const bool never_changes = in_all(runs, signal, [&](const Series& series) {
    values.insert(series.value[0]);
    return constant(series);
  });
  const bool made_one_step = signal == Signal::e_a && !values.contains(0) && !present(runs, Signal::u_ref);
  const bool is_driven = signal == Signal::i_a && (present(runs, Signal::u_ref) || present(runs, Signal::e_a));
  return never_changes && (values.size() == 1 || is_driven) && !made_one_step;
}

/// A signal that goes from level to level, of which its instrument knows but a few.
bool coarse(std::span<const Run> runs, Signal signal) {
  std::set<double> levels;
  std::size_t readings = 0, changes = 0;
  for (const Run& run : runs) {
    if (!run.has(signal)) continue;
    const auto& x = run.at(signal).value;
    levels.insert(x.begin(), x.end());
    if (levels.size() > 5) return false;
    readings += x.size();
    for (std::size_t k = 1; k < x.size(); ++k) changes += x[k] != x[k - 1] ? 1 : 0;
  }
  return levels.size() > 2 && changes > 0 && readings > 10 * changes;
}

}  // namespace

DataFindings resting(std::span<const Run> runs) {
  DataFindings findings;
  const auto add = [&](Signal signal, Flaw what, const std::string& text, bool stop) {
    findings.push_back({{}, signal, what, 0, 0, text, stop});
  };
  bool motion = false, seen = false;
  Signal still{};
  for (const Signal signal : {Signal::theta, Signal::omega}) {
    if (!present(runs, signal)) continue;
    seen = true;
    if (rest(runs, signal)) {
      still = signal;
    } else {
      motion = true;
    }
  }
  if (seen && !motion) {
    add(still, Flaw::rest, name_of(still) + " moves in no run: does the motor turn, and is its sensor connected?",
        true);
  }
  for (const Signal signal : {Signal::i_a, Signal::e_a, Signal::torque}) {
    if (!motion || !present(runs, signal) || !dead(runs, signal)) continue;
    const bool matters = signal != Signal::torque;  // a shaft without a load is told as a torque of zero, too
    add(signal, Flaw::rest,
        name_of(signal) +
            " has one value in all of a run though the shaft moves: its channel is dead; leave the column out",
        matters);
  }
  for (const Signal signal : {Signal::i_a, Signal::omega, Signal::torque}) {
    if (motion && present(runs, signal) && coarse(runs, signal)) {
      add(signal, Flaw::resolution,
          name_of(signal) +
              " knows five values or fewer: take a finer range of its instrument, or leave the column out",
          false);
    }
  }
  return findings;
}

}  // namespace emtb
