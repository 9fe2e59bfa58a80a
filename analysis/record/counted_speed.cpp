#include "analysis/record/counted_speed.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <numeric>

#include "analysis/numerics/even_series.h"
#include "analysis/numerics/statistics.h"
#include "analysis/record/repeats.h"
#include "analysis/record/smoothed_speed.h"
#include "model/effect.h"

namespace emtb {
namespace {

constexpr std::size_t fewest = 64;  // readings that tell

/// The angle by which the shaft went on with each reading but the first [rad].
std::vector<double> advances(const Series& speed, bool measured_time) {
  const double usual = mean_interval(speed.t);
  std::vector<double> all;
  for (std::size_t k = 1; k < speed.t.size(); ++k)
    all.push_back(speed.value[k] * (measured_time ? speed.t[k] - speed.t[k - 1] : usual));
  return all;
}

/// A gap would swallow what was counted in it.
bool has_gaps(const Series& speed) {
  const double usual = mean_interval(speed.t);
  for (std::size_t k = 1; k < speed.t.size(); ++k) {
    if (speed.t[k] - speed.t[k - 1] > 1.5 * usual) return true;
  }
  return false;
}

/// The step of which all are multiples. Begins with the smallest, which is one step or a few, and goes on to the
/// larger, so that the step is known well enough before many have to be told from one more.
std::optional<double> common_step(std::span<const std::vector<double>> all) {
  constexpr double nothing = 1e-9;               // of the largest
  constexpr int most_steps = 8;                  // that the smallest may be
  constexpr double close = 0.1, farthest = 0.4;  // of a step: times are written with so many digits
  std::vector<double> sizes;
  for (const auto& one : all) {
    for (const double a : one) sizes.push_back(std::abs(a));
  }
  std::ranges::sort(sizes);
  sizes.erase(sizes.begin(), std::ranges::upper_bound(sizes, sizes.empty() ? 0 : nothing * sizes.back()));
  if (sizes.empty()) return std::nullopt;
  for (int steps = 1; steps <= most_steps; ++steps) {
    double step = sizes.front() / steps, products = 0, squares = 0, off = 0, furthest = 0;
    for (const double a : sizes) {
      const double counts = std::round(a / step), miss = a / step - counts;
      furthest = std::max(furthest, std::abs(miss));
      if (furthest > farthest) break;
      off += miss * miss;
      products += counts * a;
      squares += counts * counts;
      step = products / squares;
    }
    if (furthest <= farthest && std::sqrt(off / static_cast<double>(sizes.size())) < close) return step;
  }
  return std::nullopt;
}

/// By how much a turn is off a whole number of steps; a half where no encoder has so many.
double off_a_turn(double step) {
  constexpr double least = 8, most = 2e5;
  const double a_turn = 2 * std::numbers::pi / step;
  return a_turn > least && a_turn < most ? std::abs(a_turn - std::round(a_turn)) : 0.5;
}

/// [rad/s] Units of speed that part a turn as an encoder does: rpm, turns and degrees a second.
constexpr std::array units_of_a_turn{2 * std::numbers::pi / 60, 2 * std::numbers::pi, std::numbers::pi / 180};

/// By how much a speed is off a number of at most two digits, in the last of them, in that unit which parts a turn as
/// an encoder does in which it is nearest to one.
double off_a_round_number(double speed) {
  double least = 0.5;
  for (const double unit : units_of_a_turn) {
    const double in_unit = speed / unit;
    const double digits = in_unit / std::pow(10, std::floor(std::log10(in_unit)) - 1);  // 10 to 100
    least = std::min(least, std::abs(digits - std::round(digits)));
  }
  return least;
}

/// Is a speed the last digit of a display: one revolution a minute, a tenth ..., or so of turns or degrees a second?
bool is_last_digit(double speed) {
  constexpr double close = 1e-3;
  return std::ranges::any_of(units_of_a_turn, [&](double unit) {
    const double digit = std::log10(speed / unit);
    return digit < 0.5 && std::abs(digit - std::round(digit)) < close;
  });
}

/// Is a step far nearer to a part of a turn than the speed of one in a row is to a round number? One that was rounded
/// to such a number is as near to it as it was written, and one that was counted happens to be near to one of so many.
bool rather_of_a_turn(double step, double interval) {
  constexpr double far_nearer = 0.01, is_one = 1e-4;
  const double off_round = off_a_round_number(step / interval);
  return off_round > is_one && off_a_turn(step) < far_nearer * off_round;
}

/// Counts, summed up to each reading.
std::vector<double> summed(std::span<const double> counts) {
  std::vector<double> sum{0};
  for (const double c : counts) sum.push_back(sum.back() + c);
  return sum;
}

/// Sizes of the third differences of summed counts, over a lag: what is beyond a smooth motion.
std::vector<double> third_differences(const std::vector<double>& sum, std::size_t lag) {
  std::vector<double> sizes;
  for (std::size_t k = 3 * lag; k < sum.size(); ++k)
    sizes.push_back(std::abs(sum[k] - 3 * sum[k - lag] + 3 * sum[k - 2 * lag] - sum[k - 3 * lag]));
  return sizes;
}

double mean_square(std::span<const double> sizes) {
  double squares = 0;
  for (const double size : sizes) squares += size * size;
  return squares / static_cast<double>(sizes.size());
}

/// Speeds in counts over the usual time, in pieces of so many readings, where they hop: where the shaft turns.
std::vector<std::vector<double>> hopping(std::span<const Series> speeds, double step, std::size_t length) {
  std::vector<std::vector<double>> pieces;
  for (const Series& speed : speeds) {
    const double in_counts = mean_interval(speed.t) / step;
    for (std::size_t from = 1; from + length <= speed.value.size(); from += length) {
      std::vector<double> counts;
      for (std::size_t k = from; k < from + length; ++k) counts.push_back(speed.value[k] * in_counts);
      if (std::ranges::adjacent_find(counts, std::not_equal_to{}) != counts.end()) pieces.push_back(std::move(counts));
    }
  }
  return pieces;
}

/// Of a run's pieces: a shaft that a controller drives is hardly ever steady.
constexpr double often = 0.25, hardly_ever = 0;

/// The smaller ones of some sizes tell of what is steady: a shaft that speeds up makes the others larger.
/// @param share of them that are steady; 0: one is
double of_the_steady(std::vector<double> sizes, double share) {
  if (sizes.empty()) return infinity;
  const auto largest = sizes.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(sizes.size()));
  std::ranges::nth_element(sizes, largest);
  return *largest;
}

/// Variance of hops to a neighbour or the next but one; larger changes are those of the speed.
double hop_variance(std::span<const double> counts) {
  constexpr double largest = 2;
  double squares = 0;
  for (std::size_t k = 1; k < counts.size(); ++k) {
    const double hop = std::abs(counts[k] - counts[k - 1]);
    if (hop < largest + 0.5) squares += hop * hop;
  }
  return std::max(1e-6, squares / 2 / static_cast<double>(counts.size() - 1));
}

/// Do counts add up? Over so many readings that hops at random would have led some counts away, their sum is still
/// right to one. Where counts are rare, that takes long pieces.
bool adds_up(std::span<const Series> speeds, double step) {
  constexpr double clear = 40;  // variance of what a walk would leave there, counts²
  constexpr double most = 2;    // counts; a counter leaves sqrt(20/12)
  constexpr std::size_t pieces = 3;
  for (const std::size_t length : {256, 1024, 4096}) {
    std::vector<double> left;
    for (const std::vector<double>& counts : hopping(speeds, step, length)) {
      const auto lag = static_cast<std::size_t>(std::ceil(clear / (6 * hop_variance(counts))));
      if (4 * lag > length) continue;
      left.push_back(robust_sigma(third_differences(summed(counts), lag)));
    }
    if (left.size() >= pieces) return of_the_steady(std::move(left), often) < most;
  }
  return false;
}

/// Are the sums of brief pieces as wrong over a few readings as over one, by the counts that make them? Noise of each
/// reading leaves as many times more as there are readings in between. In half of the pieces at least: a shaft that
/// speeds up makes it more in the others.
bool errs_as_a_counter(std::span<const Series> speeds, double step) {
  constexpr std::size_t length = 32, few = 4, fewest_pieces = 24;
  constexpr double twice = 2;      // a counter leaves once, noise four times
  constexpr double most_bend = 2;  // counts²; a counter leaves 20/12 at the most
  std::vector<double> bends, ratios;
  for (const std::vector<double>& counts : hopping(speeds, step, length)) {
    const std::vector<double> sum = summed(counts);
    const double bend = mean_square(third_differences(sum, 1));
    bends.push_back(bend);
    ratios.push_back(bend > 0 ? mean_square(third_differences(sum, few)) / bend : infinity);
  }
  return bends.size() >= fewest_pieces && median(std::move(bends)) < most_bend && median(std::move(ratios)) < twice;
}

/// What second differences are, rms, where the shaft is steady: a counter leaves sqrt(20/12) at the most, however it
/// turns.
/// @param length of the pieces, in readings @param share of these that are steady
double roughness(std::span<const Series> speeds, double step, std::size_t length, double share) {
  std::vector<double> bends;
  for (const std::vector<double>& counts : hopping(speeds, step, length)) {
    double squares = 0;
    for (std::size_t k = 2; k < length; ++k) squares += std::pow(counts[k] - 2 * counts[k - 1] + counts[k - 2], 2);
    bends.push_back(std::sqrt(squares / static_cast<double>(length - 2)));
  }
  return of_the_steady(std::move(bends), share);
}

constexpr double of_counts = 2;  // counts: roughness that whole counts make by themselves

/// Is there no more noise in them than that?
bool only_counts(std::span<const Series> speeds, double step, std::size_t length, double share) {
  return roughness(speeds, step, length, share) < of_counts;
}

/// The speed of each row, from means of the last rows. All that a run that begins at rest was counted before is
/// nothing.
Series of_each_row(const Series& mean, const CountedSpeed& counted) {
  const double interval = mean_interval(mean.t), n = static_cast<double>(counted.rows);
  Series each = mean;
  const std::span<double> value = each.value.edit();
  std::vector<double> sum(mean.value.size(), 0);  // of the counts, up to each row
  for (std::size_t k = 0; k < sum.size(); ++k) {
    const double since = std::round(n * mean.value[k] * interval / counted.step);
    sum[k] = (k < counted.rows ? 0 : sum[k - counted.rows]) + since;
    value[k] = (sum[k] - (k > 0 ? sum[k - 1] : 0)) * counted.step / interval;
  }
  return each;
}

/// How rough the counts of each row are, were the speeds means over so many.
double roughness_of_each_row(std::span<const Series> speeds, const CountedSpeed& counted) {
  constexpr std::size_t length = 32;
  std::vector<Series> each;
  for (const Series& speed : speeds) each.push_back(of_each_row(speed, counted));
  return roughness(each, counted.step, length, often);
}

/// Are speeds whose values are multiples of a step means over some rows, of counts that are as many times as large?
/// Over the right number what comes back is as smooth as counts are; over one row more or less it leaps from row to
/// row.
std::optional<CountedSpeed> mean_of_counts(std::span<const Series> speeds, double step) {
  constexpr std::size_t most_rows = 40;
  constexpr double close = 1e-2, leaps = 3;
  const auto over = [&](std::size_t rows) {
    return CountedSpeed{.step = static_cast<double>(rows) * step, .rows = rows};
  };
  for (std::size_t rows = most_rows; rows > 1; --rows) {
    if (off_a_turn(over(rows).step) > close) continue;
    const double rough = roughness_of_each_row(speeds, over(rows));
    const auto is_rougher = [&](std::size_t other) {
      return other == 1 || roughness_of_each_row(speeds, over(other)) > leaps * rough;
    };
    if (rough < of_counts && is_rougher(rows - 1) && is_rougher(rows + 1)) return over(rows);
  }
  return std::nullopt;
}

/// Are they whole counts by the time that each row took, where by the usual time some would not be? No converter knows
/// how long a row took.
bool told_by_unlike_rows(std::span<const Series> speeds, double step) {
  constexpr std::size_t enough = 4;           // rows: that many parts of a count are not near nothing by chance
  constexpr double none = 0.03, clear = 0.1;  // of a count
  const auto miss = [](double counts) { return std::abs(counts - std::round(counts)); };
  std::size_t telling = 0;
  for (const Series& speed : speeds) {
    const std::vector<double> measured = advances(speed, true), usual = advances(speed, false);
    for (std::size_t k = 0; k < measured.size(); ++k) {
      if (miss(measured[k] / step) > clear) return false;
      if (miss(measured[k] / step) < none && miss(usual[k] / step) > clear) ++telling;
    }
  }
  return telling >= enough;
}

/// [s] The time of which all of a run's intervals are multiples, where its times were written with few digits; 0: none.
double common_interval(std::span<const double> t) {
  constexpr double many_digits = 1e-6;  // [s]
  const double digit = last_digit_of(t);
  if (digit < many_digits) return 0;
  std::int64_t common = 0;
  for (std::size_t k = 1; k < t.size(); ++k) common = std::gcd(common, std::llround((t[k] - t[k - 1]) / digit));
  return static_cast<double>(common) * digit;
}

/// Are the speeds multiples of one whatever time their rows took, which is a multiple as well? Then so are the angles,
/// of both together, and nobody counted them: a counter does not know to count five at a time in a row of five
/// milliseconds.
bool multiples_by_no_time(std::span<const Series> speeds, double step) {
  constexpr double close = 0.1;
  for (const Series& speed : speeds) {
    const double interval = common_interval(speed.t);
    if (interval <= 0) return false;
    for (const double value : std::span(speed.value).subspan(1)) {
      const double codes = value * interval / step;
      if (std::abs(codes - std::round(codes)) > close) return false;
    }
  }
  return true;
}

/// What they are counts of, as they were written.
std::optional<CountedSpeed> counts_of(std::span<const Series> speeds) {
  const auto step_of = [&](bool measured_time) {
    std::vector<std::vector<double>> all;
    for (const Series& speed : speeds) all.push_back(advances(speed, measured_time));
    const std::optional<double> step = common_step(all);
    return step && measured_time && multiples_by_no_time(speeds, *step) ? std::nullopt : step;
  };
  if (const auto step = step_of(true); step && told_by_unlike_rows(speeds, *step))
    return CountedSpeed{.step = *step, .measured_time = true};
  for (const bool measured_time : {false, true}) {
    const std::optional<double> step = step_of(measured_time);
    if (!step) continue;
    constexpr double no_chance = 1e-3,
                     close = 1e-2;  // of a step: a converter's code hits that once in 500, in 50 times
    constexpr std::size_t brief = 8, long_enough = 32;
    const double off = off_a_turn(*step);
    const double interval = mean_interval(speeds.front().t);
    const bool hardly_else = off < no_chance && rather_of_a_turn(*step, interval);
    // A display of whole rpm parts a turn as an encoder does wherever rows last a round time.
    const bool of_a_turn = off < close && !is_last_digit(*step / interval);
    if (!measured_time) {
      if (const auto mean = mean_of_counts(speeds, *step)) return mean;
    }
    if (adds_up(speeds, *step) || errs_as_a_counter(speeds, *step) ||
        (of_a_turn && only_counts(speeds, *step, long_enough, often)) ||
        (hardly_else && only_counts(speeds, *step, brief, hardly_ever)))
      return CountedSpeed{.step = *step, .measured_time = measured_time};
  }
  return std::nullopt;
}

/// What smoothed speeds were counts of: whole ones come back wherever the digits that were written suffice.
std::optional<CountedSpeed> counts_before_smoothing(std::span<const Series> speeds) {
  constexpr double nothing = 1, clear = 5;  // of what rounding leaves: it makes steps of its own
  const std::optional<Smoothing> smoothing = smoothing_of(speeds);
  if (!smoothing) return std::nullopt;
  std::vector<Series> raw;
  for (const Series& speed : speeds) {
    raw.push_back(before_smoothing(speed, smoothing->kept));
    for (double& y : raw.back().value.edit()) y = std::abs(y) > nothing * smoothing->rounding ? y : 0;
  }
  std::optional<CountedSpeed> counted = counts_of(raw);
  if (!counted) return std::nullopt;
  const double of_a_row = static_cast<double>(counted->rows) * mean_interval(speeds.front().t);
  if (counted->step / of_a_row < clear * smoothing->rounding) return std::nullopt;
  counted->kept = smoothing->kept;
  return counted;
}

}  // namespace

std::optional<CountedSpeed> counted_speed(std::span<const Run> runs, std::span<const Run> others) {
  std::vector<Series> speeds;
  std::size_t readings = 0;
  for (const std::span<const Run> some : {runs, others}) {
    for (const Run& run : some) {
      if (!run.has(Signal::omega)) return std::nullopt;
      speeds.push_back(updates_of(run.at(Signal::omega)));
      if (speeds.back().window > 0 || speeds.back().t.size() < 3 || has_gaps(speeds.back())) return std::nullopt;
      readings += speeds.back().t.size();
    }
  }
  if (readings < fewest) return std::nullopt;
  if (const auto counted = counts_of(speeds)) return counted;
  return counts_before_smoothing(speeds);
}

std::vector<Run> with_counted_angle(std::span<const Run> runs, const CountedSpeed& counted) {
  std::vector<Run> all(runs.begin(), runs.end());
  for (Run& run : all) {
    const Series logged = updates_of(run.at(Signal::omega));
    const Series raw = counted.kept > 0 ? before_smoothing(logged, counted.kept) : logged;
    const Series speed = counted.rows > 1 ? of_each_row(raw, counted) : raw;
    run.signals.erase(Signal::omega);
    if (run.has(Signal::theta)) continue;  // the counter itself
    Series& theta = run.signals[Signal::theta];
    theta.lsb = counted.step;
    theta.source = speed.source;
    theta.t = speed.t;
    theta.value.push_back(0);
    for (const double advance : advances(speed, counted.measured_time))
      theta.value.push_back(theta.value.back() + counted.step * std::round(advance / counted.step));
  }
  return all;
}

}  // namespace emtb
