#include "analysis/numerics/first_value.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "analysis/numerics/statistics.h"

namespace emtb {
namespace {

constexpr std::size_t fewest = 3;
constexpr double clear = 3;  // errors beyond which something is no noise

struct Line {
  FirstValue first;
  double scatter = 0;  ///< about it
};

/// Of readings by their second differences, which a bend hardly moves; a step of the instrument at the least.
double scatter_of(std::span<const double> y, double lsb) {
  double squares = 0;
  for (std::size_t i = 2; i < y.size(); ++i) squares += std::pow(y[i] - 2 * y[i - 1] + y[i - 2], 2);
  return std::sqrt(squares / 6 / static_cast<double>(y.size() - 2)) + lsb;
}

Line line_through(std::span<const double> t, std::span<const double> y, double start, double lsb) {
  double st = 0, sy = 0, stt = 0, sty = 0;
  for (std::size_t i = 0; i < y.size(); ++i) {
    const double at = t[i] - start;
    st += at, sy += y[i], stt += at * at, sty += at * y[i];
  }
  const auto n = static_cast<double>(y.size());
  const double spread = stt - st * st / n;  // [s^2]
  Line line;
  FirstValue& first = line.first;
  first.slope = spread > 0 ? (sty - st * sy / n) / spread : 0;
  first.value = (sy - first.slope * st) / n;
  double squares = 0;
  for (std::size_t i = 0; i < y.size(); ++i) squares += std::pow(y[i] - first.value - first.slope * (t[i] - start), 2);
  line.scatter = std::sqrt(squares / std::max(1.0, n - 2));
  first.error = 2 * line.scatter / std::sqrt(n) + lsb;
  first.slope_error = spread > 0 ? (line.scatter + lsb) / std::sqrt(spread) : 0;
  return line;
}

/// The readings that are looked at.
std::size_t first_readings(std::span<const double> t, double start) {
  std::size_t n = 0;
  while (n < t.size() && (n < fewest || t[n] < start + first_value_within)) ++n;
  return n;
}

}  // namespace

bool FirstValue::is_other_than(double expected) const { return std::abs(value - expected) > clear * error; }

bool FirstValue::may_be_other_than(double expected) const { return std::abs(value - expected) > error; }

bool FirstValue::moves() const { return std::abs(slope) > clear * slope_error; }

bool FirstValue::may_move() const { return std::abs(slope) > slope_error; }

bool FirstValue::may_move_at(double speed) const { return std::abs(slope - speed) <= clear * slope_error; }

std::optional<FirstValue> first_value(std::span<const double> t, std::span<const double> y, double start, double lsb) {
  std::size_t n = first_readings(t, start);
  if (n < fewest) return std::nullopt;
  Line line = line_through(t.first(n), y.first(n), start, lsb);
  // A small servo rests and is at full speed within that time: where the readings bend more than they scatter, half as
  // many tell it better.
  while (n / 2 >= fewest && line.scatter > clear * scatter_of(y.first(n), lsb)) {
    n /= 2;
    line = line_through(t.first(n), y.first(n), start, lsb);
  }
  return line.first;
}

std::optional<FirstValue> first_value_of_what_jumps(std::span<const double> t, std::span<const double> y, double start,
                                                    double lsb) {
  constexpr std::size_t enough = 12;  // readings, of which a jump bends few
  const std::size_t n = first_readings(t, start);
  if (n < enough) return first_value(t, y, start, lsb);
  std::vector<double> bends;
  for (std::size_t i = 2; i < n; ++i) bends.push_back(std::abs(y[i] - 2 * y[i - 1] + y[i - 2]));
  const double noise = robust_sigma(std::move(bends)) / std::sqrt(6.0) + lsb;
  if (line_through(t.first(fewest), y.first(fewest), start, lsb).scatter <= clear * noise)
    return first_value(t, y, start, lsb);
  const double interval = t[1] - t[0];
  return FirstValue{y[0], 2 * noise, (y[1] - y[0]) / interval, 2 * noise / interval};
}

std::size_t end_of_first_hold(std::span<const double> input) {
  const auto changed = std::ranges::find_if(input, [&](double u) { return u != input.front(); });
  const auto held = static_cast<std::size_t>(changed - input.begin());
  return held >= fewest ? held : input.size();
}

}  // namespace emtb
