#include "analysis/check/windows.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace emtb {
namespace {

/// Means of a series over times.
class Means {
 public:
  explicit Means(const Series& s) : s_(s), sum_(s.value.size() + 1, 0) {
    for (std::size_t k = 0; k < s.value.size(); ++k) sum_[k + 1] = sum_[k] + s.value[k];
  }
  /// NAN without a reading in from < t <= to.
  double over(double from, double to) const {
    const auto a = place(from), b = place(to);
    return b > a ? (sum_[b] - sum_[a]) / static_cast<double>(b - a) : std::numeric_limits<double>::quiet_NaN();
  }
  /// By how much it grew, per second.
  double slope(double from, double to) const {
    const auto a = place(from), b = place(to);
    return b > a + 1 ? (s_.value[b - 1] - s_.value[a]) / (s_.t[b - 1] - s_.t[a])
                     : std::numeric_limits<double>::quiet_NaN();
  }

 private:
  std::size_t place(double t) const {
    return static_cast<std::size_t>(std::ranges::upper_bound(s_.t, t) - s_.t.begin());
  }
  const Series& s_;
  std::vector<double> sum_;
};

bool dense(const Run& run, Signal s) { return run.has(s) && !is_sparse(run, s); }

/// Does a logger write a signal, if not in each of its rows, often enough to tell a motion?
bool tells_the_motion(const Run& run, Signal s) {
  constexpr std::size_t readings = 200;
  return dense(run, s) || (run.has(s) && run.at(s).t.size() >= readings);
}

/// Is the current read by a meter each of whose readings is a window by itself? There are far fewer than of the speed.
bool is_metered(const Run& run, const Series& speed) {
  constexpr std::size_t rows_each = 5;
  return run.has(Signal::i_a) && is_sparse(run, Signal::i_a) &&
         rows_each * run.at(Signal::i_a).t.size() < speed.t.size();
}

struct Span {
  double from = 0, to = 0;  ///< [s]
};

std::vector<Span> spans_of(const Run& run, const Series& rows, bool metered) {
  std::vector<Span> spans;
  if (metered) {
    const Series& meter = run.at(Signal::i_a);
    for (std::size_t k = 1; k < meter.t.size(); ++k) spans.push_back({window_start(meter, k), meter.t[k]});
    return spans;
  }
  const std::size_t length = std::max<std::size_t>(10, rows.t.size() / 400);
  for (std::size_t k = length; k < rows.t.size(); k += length) spans.push_back({rows.t[k - length], rows.t[k]});
  return spans;
}

/// Speeds of neighbours tell the acceleration of each.
void set_accelerations(MotionWindows& w, const std::vector<Span>& spans) {
  const std::size_t n = w.all.size();
  for (std::size_t k = 1; k + 1 < n; ++k) {
    const double apart = 0.5 * (spans[k + 1].from + spans[k + 1].to - spans[k - 1].from - spans[k - 1].to);
    w.all[k].acceleration = (w.all[k + 1].speed - w.all[k - 1].speed) / apart;
  }
}

}  // namespace

MotionWindows motion_windows(const Run& run) {
  MotionWindows w;
  for (const Signal s : {Signal::e_a, Signal::u_ref}) {
    if (!w.voltage && dense(run, s)) w.voltage = s;
  }
  for (const Signal s : {Signal::omega, Signal::theta}) {
    if (!w.speed && tells_the_motion(run, s)) w.speed = s;
  }
  w.current = run.has(Signal::i_a);
  w.torque = dense(run, Signal::torque);
  if (!w.speed) return w;
  const Series& rows = run.at(*w.speed);
  const bool metered = is_metered(run, rows);
  const std::vector<Span> spans = spans_of(run, rows, metered);
  const auto means_of = [&](Signal s, bool wanted) {
    static const Series none;
    return Means(wanted ? run.at(s) : none);
  };
  const Means speed(run.at(*w.speed)), voltage = means_of(w.voltage.value_or(Signal::e_a), w.voltage.has_value()),
                                       current = means_of(Signal::i_a, w.current),
                                       torque = means_of(Signal::torque, w.torque),
                                       open = means_of(Signal::armature_open, run.has(Signal::armature_open));
  std::vector<bool> whole;
  for (const Span& s : spans) {
    MotionWindow m;
    m.speed = w.speed == Signal::omega ? speed.over(s.from, s.to) : speed.slope(s.from, s.to);
    if (w.voltage) m.voltage = voltage.over(s.from, s.to);
    // A slow meter's reading bears the time at which its window ends.
    if (w.current) m.current = current.over(metered ? 0.5 * (s.from + s.to) : s.from, s.to);
    if (w.torque) m.torque = torque.over(s.from, s.to);
    const double disconnected = open.over(s.from, s.to);
    whole.push_back(std::isfinite(m.speed) && std::isfinite(m.voltage) && std::isfinite(m.current) &&
                    std::isfinite(m.torque) && !(disconnected > 0));
    w.all.push_back(m);
  }
  set_accelerations(w, spans);
  double fastest = 0;
  for (const MotionWindow& m : w.all) fastest = std::max(fastest, std::abs(m.speed));
  w.starts_at_rest = !w.all.empty() && std::abs(w.all.front().speed) <= 0.3 * fastest;
  std::vector<MotionWindow> kept;
  for (std::size_t k = 1; k + 1 < w.all.size(); ++k) {
    if (whole[k] && std::isfinite(w.all[k].acceleration)) kept.push_back(w.all[k]);
  }
  w.all = std::move(kept);
  return w;
}

void append(MotionWindows& to, const MotionWindows& more) {
  if (to.all.empty()) {
    to = more;
    return;
  }
  if (to.voltage != more.voltage || to.speed != more.speed || to.current != more.current || to.torque != more.torque)
    return;
  to.starts_at_rest = to.starts_at_rest && more.starts_at_rest;
  to.all.insert(to.all.end(), more.all.begin(), more.all.end());
}

}  // namespace emtb
