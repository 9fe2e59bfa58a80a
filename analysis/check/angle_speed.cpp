#include "analysis/check/angle_speed.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "analysis/check/readings.h"
#include "analysis/check/units.h"

namespace emtb {
namespace {

/// The integral of a series over time, at any time: trapezoids.
class Integral {
 public:
  explicit Integral(const Series& s) : s_(s), sum_(s.t.size(), 0) {
    for (std::size_t k = 1; k < s.t.size(); ++k)
      sum_[k] = sum_[k - 1] + 0.5 * (s.value[k] + s.value[k - 1]) * (s.t[k] - s.t[k - 1]);
  }
  double at(double t) const {
    const auto above = static_cast<std::size_t>(std::ranges::lower_bound(s_.t, t) - s_.t.begin());
    if (above == 0) return sum_.front();
    if (above == s_.t.size()) return sum_.back();
    const double share = (t - s_.t[above - 1]) / (s_.t[above] - s_.t[above - 1]);
    return sum_[above - 1] + share * (sum_[above] - sum_[above - 1]);
  }

 private:
  const Series& s_;
  std::vector<double> sum_;
};

constexpr double of_one_motion = 0.9;  // correlation: noise goes its own way

/// How well increments of the angle are a factor times those of the speed's integral.
struct Agreement {
  double factor = 0, correlation = 0;
  double factor_beside_offset = 0;  ///< where the speed has an offset: the slope of a line
  double offset = 0;                ///< [rad/s] of the speed, by that line; 0 where none of a slope is to be seen
  double left = 0;                  ///< [rad] rms of an increment
  double delay = 0;                 ///< [s] by which the speed is later than the angle
};

class Comparison {
 public:
  explicit Comparison(const Run& run) : theta_(run.at(Signal::theta)), turned_(run.at(Signal::omega)) {
    rows_ = std::max<std::size_t>(5, theta_.t.size() / 1000);
  }

  std::size_t rows() const { return rows_; }

  Agreement at(double delay) const {
    const auto& t = theta_.t;
    double aa = 0, ab = 0, bb = 0, a_mean = 0, b_mean = 0, window = 0;
    double n = 0;
    for (std::size_t k = rows_; k < t.size(); k += rows_) {
      const double from = t[k - rows_] + delay, to = t[k] + delay;
      if (from < t.front() || to > t.back()) continue;
      const double a = theta_.value[k] - theta_.value[k - rows_], b = turned_.at(to) - turned_.at(from);
      aa += a * a, ab += a * b, bb += b * b;
      a_mean += a, b_mean += b, window += to - from;
      n += 1;
    }
    if (n < 10 || aa <= 0 || bb <= 0) return {};
    const double factor = ab / bb;
    Agreement found{.factor = factor,
                    .correlation = ab / std::sqrt(aa * bb),
                    .factor_beside_offset = factor,
                    .offset = 0,
                    .left = std::sqrt(std::max(0.0, aa - factor * ab) / n),
                    .delay = delay};
    a_mean /= n, b_mean /= n, window /= n;
    const double var_a = aa - n * a_mean * a_mean, cov = ab - n * a_mean * b_mean, var_b = bb - n * b_mean * b_mean;
    if (var_a > 0 && var_b > 0 && cov > of_one_motion * std::sqrt(var_a * var_b)) {
      found.factor_beside_offset = cov / var_b;
      found.offset = (b_mean - a_mean / found.factor_beside_offset) / window;
    }
    return found;
  }

  /// At the delay at which they agree best, of up to a second.
  Agreement best() const {
    const auto& t = theta_.t;
    const double interval = t.back() / static_cast<double>(t.size() - 1);
    const double reach = std::min(1.0, t.back() / 10);
    Agreement best = at(0);
    double grid = std::max(interval, reach / 100), centre = 0, width = reach;
    for (int round = 0; round < 2; ++round) {
      for (double d = centre - width; d <= centre + width; d += grid) {
        const Agreement here = at(d);
        if (std::abs(here.correlation) > std::abs(best.correlation) + 1e-12) best = here;
      }
      centre = best.delay, width = grid, grid = std::max(interval / 2, grid / 10);
    }
    return best;
  }

 private:
  const Series& theta_;
  Integral turned_;
  std::size_t rows_ = 0;
};

/// No sensor's error, but a gear.
bool is_off(double factor) { return factor > 1.1 || factor < 0.9; }

bool has_both(const Run& run) {
  return std::ranges::all_of(std::array{Signal::theta, Signal::omega},
                             [&](Signal s) { return run.has(s) && !is_sparse(run, s) && run.at(s).t.size() >= 100; });
}

DataFinding one_rests(const Run& run, Signal rests, Signal moving) {
  return {run.name,
          rests,
          Flaw::rest,
          0,
          run.duration(),
          name_of(rests) + " rests while " + name_of(moving) + " moves: see to its sensor, or leave the column out",
          true};
}

}  // namespace

double speed_read_at_rest(const Run& run) {
  if (!has_both(run)) return 0;
  const Agreement found = Comparison(run).best();
  return is_off(found.factor_beside_offset) ? 0 : found.offset;
}

DataFindings angle_against_speed(const Run& run) {
  if (!has_both(run)) return {};
  const Series &theta = run.at(Signal::theta), &omega = run.at(Signal::omega);
  const auto [low, high] = std::ranges::minmax(theta.value);
  const double count = step_of(theta);
  const bool angle_moves = count > 0 && high - low > 20 * count;
  const Comparison comparison(run);
  const Agreement now = comparison.at(0);
  const bool follows = !constant(omega) && std::abs(now.correlation) > of_one_motion;
  if (!moves(omega) && !follows) {
    return angle_moves && high - low > 0.5 ? DataFindings{one_rests(run, Signal::omega, Signal::theta)}
                                           : DataFindings{};
  }
  const double reach = Integral(omega).at(omega.t.back());
  if (!angle_moves) {
    return std::abs(reach) > 6 && high - low <= count ? DataFindings{one_rests(run, Signal::theta, Signal::omega)}
                                                      : DataFindings{};
  }

  const Agreement best = comparison.best();
  const double interval = theta.t.back() / static_cast<double>(theta.t.size() - 1);
  const double window = interval * static_cast<double>(comparison.rows());
  const double noise = count + noise_of(omega.value, 0) * window;
  const DataFinding found{run.name, Signal::omega, Flaw::angle_speed, 0, run.duration(), {}, true};
  DataFindings findings;
  const auto add = [&](Flaw what, Signal signal, const std::string& text, bool stop) {
    DataFinding f = found;
    f.what = what, f.signal = signal, f.text = text, f.stops = stop;
    findings.push_back(f);
  };
  if (std::abs(best.correlation) < of_one_motion) {
    if (best.left > 5 * noise) {
      add(Flaw::angle_speed, Signal::theta,
          "theta and the integral of omega are not of one motion, whatever their scale (correlation " +
              short_number(best.correlation) + "): does the angle wrap, or slip? Leave one of them out",
          true);
    }
    return findings;
  }
  if (best.factor < 0) {
    add(Flaw::sign, Signal::omega, "omega falls where theta rises: turn the sign of one of them (scale: -1)", true);
  }
  const double factor = std::abs(best.factor);
  if (const auto unit = unit_slip(factor)) {
    const Signal wrong = unit->of_first ? Signal::theta : Signal::omega;
    add(Flaw::scale, wrong,
        "theta's derivative is " + short_number(factor) + " times omega: " + name_of(wrong) + " seems to be in " +
            std::string(unit->unit) + ". Say so with --map, unit:",
        true);
  } else if (is_off(factor) && is_off(std::abs(best.factor_beside_offset))) {
    add(Flaw::scale, Signal::omega,
        "theta's derivative is " + short_number(factor) +
            " times omega: a gear between them, or a sensor's factor. "
            "Scale one of them to the other",
        factor > 1.3 || factor < 0.75);
  }
  const double unmatched_now = 1 - now.correlation * now.correlation,
               unmatched = 1 - best.correlation * best.correlation;
  if (std::abs(best.delay) > std::max(3 * interval, 5e-3) && unmatched_now > 2 * unmatched && now.left > 2 * noise) {
    const bool speed_late = best.delay > 0;
    add(Flaw::delay, speed_late ? Signal::omega : Signal::theta,
        std::string(speed_late ? "omega is " : "theta is ") + short_number(std::abs(best.delay)) + " s later than " +
            (speed_late ? "theta" : "omega") + ": move its times, or leave it to an effect of the sensor",
        false);
  }
  return findings;
}

}  // namespace emtb
