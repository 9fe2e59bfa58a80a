#include "analysis/check/readings.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "analysis/numerics/equal_readings.h"
#include "analysis/numerics/statistics.h"

namespace emtb {

double step_of(const Series& series) {
  if (series.lsb > 0) return series.lsb;
  const double same = 1e-9 * size_of(series.value);  // arithmetic on codes
  double least = 0;
  for (std::size_t k = 1; k < series.value.size(); ++k) {
    const double change = std::abs(series.value[k] - series.value[k - 1]);
    if (change > same && (least == 0 || change < least)) least = change;
  }
  return least;
}

namespace {

/// The count of which angles are whole multiples, to a twentieth rms; 0 where there is none, or it is too fine for
/// that.
double count_of(std::span<const double> angles) {
  constexpr int most = 8;  // counts in the smallest
  constexpr double alike = 0.02, off = 0.05;
  double least = HUGE_VAL;
  for (const double a : angles) {
    if (a != 0) least = std::min(least, std::abs(a));
  }
  if (least == HUGE_VAL) return 0;
  double sum = 0, n = 0;
  for (const double a : angles) {
    if (a != 0 && std::abs(a) < (1 + alike) * least) sum += std::abs(a), n += 1;
  }
  for (int counts = 1; counts <= most; ++counts) {
    const double q = sum / n / counts;
    double squares = 0;
    for (const double a : angles) squares += std::pow(a / q - std::round(a / q), 2);
    if (squares < off * off * static_cast<double>(angles.size())) return q;
  }
  return 0;
}

}  // namespace

double step_of_speed(const Series& speed) {
  const double step = step_of(speed);
  std::vector<double> angles;
  for (std::size_t k = 1; k < speed.t.size(); ++k) angles.push_back(speed.value[k] * (speed.t[k] - speed.t[k - 1]));
  if (angles.empty()) return step;
  return std::max(step, count_of(angles) * static_cast<double>(angles.size()) / (speed.t.back() - speed.t.front()));
}

double noise_of(std::span<const double> x, double rest) {
  std::vector<double> second;
  for (std::size_t k = 1; k + 1 < x.size(); ++k) {
    if (std::abs(x[k]) > rest) second.push_back(std::abs(x[k + 1] - 2 * x[k] + x[k - 1]));
  }
  return second.size() < 30 ? 0 : robust_sigma(second) / std::sqrt(6.0);
}

void Hops::add(double before, double reading, double after, double step) {
  const double there = reading - before, back = after - reading;
  if (there * back >= 0) return;
  ++turns;
  far += std::max(std::abs(there), std::abs(back)) > 1.5 * step ? 1 : 0;
}

Restlessness restlessness(std::span<const double> x, double rest, double step, std::optional<double> without) {
  std::vector<std::size_t> lengths;
  std::size_t readings = 0;
  for (const EqualReadings& s : equal_readings(x)) {
    if (std::abs(s.value) <= rest || s.value == without) continue;
    lengths.push_back(s.length());
    readings += s.length();
  }
  Restlessness r;
  std::ranges::sort(lengths);
  if (!lengths.empty()) r.rare = lengths[lengths.size() * 99 / 100];
  std::size_t sum = 0;
  for (const std::size_t length : lengths) {
    sum += length;
    r.length = length;
    if (2 * sum >= readings) break;
  }
  std::vector<double> second;
  Hops hops;
  for (std::size_t k = 1; k + 1 < x.size(); ++k) {
    if (std::abs(x[k]) <= rest || x[k - 1] == without || x[k] == without || x[k + 1] == without) continue;
    second.push_back(std::abs(x[k + 1] - 2 * x[k] + x[k - 1]));
    hops.add(x[k - 1], x[k], x[k + 1], step);
  }
  if (second.size() < 30) return r;
  const double noise = robust_sigma(second) / std::sqrt(6.0);
  // A ramp changes at each reading, too, but not to and fro.
  const bool to_and_fro = static_cast<double>(hops.turns) > 0.15 * static_cast<double>(second.size());
  r.noisy = to_and_fro && hops.beyond_neighbours() && (noise > 0.7 * step || r.length <= 3);
  return r;
}

Drives::Drives(const Run& run, Signal signal, Change counts, double margin) {
  for (const Signal s : {Signal::u_ref, Signal::e_a}) {
    if (!run.has(s) || s == signal || run.at(s).t.size() < 2) continue;
    const Series& input = run.at(s);
    const double step =
        s == Signal::u_ref ? input.lsb : step_of(input);  // of a reference that is set: as it is written
    drives_.push_back({&input, margin * input.t.back() / static_cast<double>(input.t.size() - 1),
                       counts == Change::any ? 0 : std::max(3 * step, 0.02 * size_of(input.value))});
  }
}

bool Drives::change(double from, double to) const {
  for (const auto& [input, rows, least] : drives_) {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (auto k = static_cast<std::size_t>(std::ranges::lower_bound(input->t, from - rows) - input->t.begin());
         k < input->t.size() && input->t[k] <= to + rows; ++k) {
      low = std::min(low, input->value[k]);
      high = std::max(high, input->value[k]);
    }
    if (high - low > least) return true;
  }
  return false;
}

Restlessness undriven_restlessness(const Run& run, Signal signal, double rest, std::optional<double> without) {
  constexpr std::size_t least = 20;  // readings in a row, for the ends not to count
  const Series& series = run.at(signal);
  // A voltage does all that its reference does, the noise of a controller, too.
  const Drives drives(run, signal, signal == Signal::e_a ? Drives::Change::any : Drives::Change::large);
  std::vector<double> staying(series.value.size(), 0);  // at rest, which is left out, where the drives move
  std::size_t begin = 0;
  for (std::size_t k = 0; k <= staying.size(); ++k) {
    if (k < staying.size() && !drives.change(series.t[k], series.t[k])) continue;
    if (k - begin >= least)
      std::copy_n(series.value.begin() + static_cast<std::ptrdiff_t>(begin), k - begin,
                  staying.begin() + static_cast<std::ptrdiff_t>(begin));
    begin = k + 1;
  }
  return restlessness(staying, rest, step_of(series), without);
}

Restlessness own_restlessness(const Run& run, Signal signal, double rest, std::optional<double> without) {
  const Series& series = run.at(signal);
  if (signal == Signal::e_a) return undriven_restlessness(run, signal, rest, without);
  return restlessness(series.value, rest, step_of(series), without);
}

namespace {

/// Whether the quarters of a run lie apart by more than noise could, be it coloured: a speed of a count or two from row
/// to row is told by its means alone.
bool quarters_differ(std::span<const double> x) {
  constexpr double clear = 5, coloured = 8;  // standard errors; of noise that keeps 0.97 from reading to reading
  const std::size_t length = x.size() / 4;
  if (length < 100) return false;
  double least = HUGE_VAL, most = -HUGE_VAL, squares = 0;
  for (std::size_t quarter = 0; quarter < 4; ++quarter) {
    const std::span<const double> part = x.subspan(quarter * length, length);
    double mean = 0;
    for (const double value : part) mean += value / static_cast<double>(length);
    for (const double value : part) squares += (value - mean) * (value - mean);
    least = std::min(least, mean);
    most = std::max(most, mean);
  }
  const double scatter = std::sqrt(squares / static_cast<double>(4 * length));
  return most - least > clear * coloured * scatter / std::sqrt(static_cast<double>(length));
}

/// The size of a reading in the middle of all.
double middle_size(std::span<const double> x) {
  std::vector<double> sizes;
  for (const double value : x) sizes.push_back(std::abs(value));
  return median(std::move(sizes));
}

/// Whether a reading is nothing mostly, and now and then a count, to the same side.
bool counts_to_one_side(std::span<const double> x) {
  constexpr std::ptrdiff_t enough = 30;
  const auto up = std::ranges::count_if(x, [](double v) { return v > 0; });
  const auto down = std::ranges::count_if(x, [](double v) { return v < 0; });
  const auto counts = up + down;
  return 2 * counts < std::ssize(x) && std::abs(up - down) > std::max(enough, counts / 2);
}

}  // namespace

bool constant(const Series& series) {
  return std::ranges::all_of(series.value, [&](double v) { return v == series.value.front(); });
}

bool moves(const Series& series) {
  const std::vector<double>& x = series.value;
  const auto [low, high] = std::ranges::minmax(x);
  const double step = step_of(series), noise = noise_of(x, 0);
  // Second differences make coloured noise four times too small.
  if (noise > 0.5 * step ? high - low > 40 * noise : step > 0 && high - low > 3.5 * step) return true;
  if (noise > 0.5 * step && middle_size(x) > 12 * noise) return true;  // a short run goes up, and stays there
  if (high - low > 0.9 * step && (quarters_differ(x) || counts_to_one_side(x))) return true;
  const std::size_t length = std::min<std::size_t>(100, x.size());
  double far = 0;
  std::vector<double> scatter;
  for (std::size_t k = 0; k + length <= x.size() && length > 0; k += length) {
    const double* const begin = x.data() + k;
    double mean = 0, off = 0;
    for (std::size_t i = 0; i < length; ++i) mean += begin[i] / static_cast<double>(length);
    for (std::size_t i = 0; i < length; ++i) off += (begin[i] - mean) * (begin[i] - mean);
    far = std::max(far, std::abs(mean));
    scatter.push_back(std::sqrt(off / static_cast<double>(length)));
  }
  if (scatter.empty()) return false;
  return low != high && far > std::max(5 * median(scatter), 0.9 * step);
}

double size_of(std::span<const double> x) {
  double largest = 0;
  for (const double value : x) largest = std::max(largest, std::abs(value));
  return largest;
}

std::vector<Signal> measured_signals(const Run& run) {
  std::vector<Signal> found;
  for (const Signal s : {Signal::e_a, Signal::i_a, Signal::omega, Signal::theta, Signal::torque, Signal::i_f}) {
    if (!run.has(s) || is_sparse(run, s) || run.at(s).t.size() < 20) continue;
    if (s == Signal::e_a && !run.has(Signal::u_ref)) continue;
    if (s == Signal::i_a && !run.has(Signal::u_ref) && !run.has(Signal::e_a)) continue;  // a current drive's command
    found.push_back(s);
  }
  return found;
}

std::string name_of(Signal signal) { return std::string(info(signal).name); }

std::string short_number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

}  // namespace emtb
