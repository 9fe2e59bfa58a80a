#include "analysis/record/log_alignment.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "analysis/numerics/linear_algebra.h"
#include "analysis/numerics/statistics.h"
#include "hal/error.h"

namespace emtb {
namespace {

// Where nothing else is said: by hand, held by the tests of log_alignment, which place logs of 0.3 to 1 s in runs of
// the simulated bench with clocks that differ by up to 300 ppm.
constexpr std::size_t fewest = 12;       // readings: twice what is fitted
constexpr double overlap = 0.6;          // of the shorter of run and log
constexpr double coarse = 0.25;          // windows, from offset to offset
constexpr double fine = 0.025;           // windows
constexpr double near = 2;               // windows: closer is the same place
constexpr double least_explained = 0.8;  // of the log's variance
constexpr double unlike = 1.5;           // times what is unexplained, at any other place
constexpr double evidence = 12;          // and of twice the log likelihood: 3.5 sigma
constexpr double most_drift = 500e-6;    // of two crystals, one of them hot
constexpr double drift_step = 50e-6;     // a tenth of that
constexpr double model_error = 0.05;     // windows: what standing friction and heating shift the place by
constexpr std::size_t enough = 200;      // readings for a first look
constexpr double turning = 2;            // [rad/s] below, the machine may stand
constexpr double to_a_window = 10;       // a window in lengths over whose means a speed's change is taken
constexpr double fitted = 7;             // five coefficients, offset and drift

std::string seconds(double value) {
  std::ostringstream text;
  text.precision(4);
  text << value << " s";
  return text.str();
}

/// A signal's integral, so that its mean over any window costs two look-ups.
class Integral {
 public:
  template <class Of>
  Integral(const Series& series, Of of) : t_(series.t), sum_(series.t.size()) {
    for (std::size_t k = 1; k < t_.size(); ++k) {
      sum_[k] = sum_[k - 1] + (t_[k] - t_[k - 1]) * (of(series.value[k]) + of(series.value[k - 1])) / 2;
    }
  }
  double mean(double from, double to) const { return (at(to) - at(from)) / (to - from); }

 private:
  double at(double t) const {
    const auto after = std::ranges::upper_bound(t_, t);
    const auto k = std::clamp<std::ptrdiff_t>(after - t_.begin(), 1, static_cast<std::ptrdiff_t>(t_.size()) - 1);
    const auto i = static_cast<std::size_t>(k);
    return sum_[i - 1] + (sum_[i] - sum_[i - 1]) * (t - t_[i - 1]) / (t_[i] - t_[i - 1]);
  }
  SharedColumn<double> t_;
  std::vector<double> sum_;
};

/// What of the log the run leaves unexplained at some place.
struct Misfit {
  double share = 1;  ///< of the variance of the readings that lie in the run
  double squares = 0;
  std::size_t readings = 0;
};

class Likeness {
 public:
  Likeness(const Run& run, const Series& log) : log_(log) {
    if (run.has(Signal::omega)) {
      omega_.emplace(run.at(Signal::omega), [](double w) { return w; });
      turning_.emplace(run.at(Signal::omega), [](double w) { return std::tanh(w / turning); });
      limit(run.at(Signal::omega));
    }
    if (run.has(Signal::e_a)) {
      e_a_.emplace(run.at(Signal::e_a), [](double e) { return e; });
      limit(run.at(Signal::e_a));
    }
    if (!omega_ && !e_a_) throw SessionError("the run has neither omega nor e_a: nothing tells where the log belongs");
    if (log.t.size() < fewest) {
      throw SessionError("the log has " + std::to_string(log.t.size()) + " readings; " + std::to_string(fewest) +
                         " are the least");
    }
    std::vector<double> spacing;
    for (std::size_t k = 1; k < log.t.size(); ++k) spacing.push_back(log.t[k] - log.t[k - 1]);
    window_ = log.window > 0 ? log.window : median(std::move(spacing));
    middle_ = (log.t.front() + log.t.back()) / 2;
  }

  double window() const { return window_; }
  double middle() const { return middle_; }
  double span() const { return log_.t.back() - log_.t.front(); }  ///< [s] of the log
  std::size_t stride() const { return std::max<std::size_t>(log_.t.size() / enough, 1); }
  double first_offset() const { return begin_ - log_.t.back(); }
  double last_offset() const { return end_ - log_.t.front(); }

  /// @return nothing where too little of the log lies in the run
  std::optional<Misfit> at(double offset, double drift, std::size_t stride = 1) const {
    const double reach = window_ / to_a_window;
    std::vector<std::size_t> inside;
    for (std::size_t k = 0; k < log_.t.size(); k += stride) {
      const double t = place(k, offset, drift);
      if (t - window_ - reach >= begin_ && t + reach <= end_) inside.push_back(k);
    }
    const double shorter = std::min(end_ - begin_, span());
    if (inside.size() < fewest || log_.t[inside.back()] - log_.t[inside.front()] < overlap * shorter) {
      return std::nullopt;
    }
    Eigen::VectorXd y(static_cast<Eigen::Index>(inside.size()));
    for (Eigen::Index r = 0; r < y.size(); ++r) y[r] = log_.value[inside[static_cast<std::size_t>(r)]];
    const double total = (y.array() - y.mean()).square().sum();
    if (!(total > 0)) return std::nullopt;
    const Eigen::MatrixXd a = run_at(inside, offset, drift);
    const double squares = (y - product(a, least_squares(a, y))).squaredNorm();
    return Misfit{.share = squares / total, .squares = squares, .readings = inside.size()};
  }

 private:
  void limit(const Series& series) {
    if (series.t.size() < fewest) throw SessionError("the run is too short to place a log in it");
    begin_ = std::max(begin_, series.t.front());
    end_ = std::min(end_, series.t.back());
  }

  /// What the run says of a current at these readings' places: one row a reading, one column a coefficient.
  Eigen::MatrixXd run_at(const std::vector<std::size_t>& readings, double offset, double drift) const {
    const double reach = window_ / to_a_window;
    const Eigen::Index columns = 1 + (omega_ ? 3 : 0) + (e_a_ ? 1 : 0);
    Eigen::MatrixXd a(static_cast<Eigen::Index>(readings.size()), columns);
    for (Eigen::Index r = 0; r < a.rows(); ++r) {
      const double to = place(readings[static_cast<std::size_t>(r)], offset, drift);
      const double from = to - window_;
      Eigen::Index c = 0;
      a(r, c++) = 1;
      if (omega_) {
        a(r, c++) = omega_->mean(from, to);
        a(r, c++) = (omega_->mean(to - reach, to + reach) - omega_->mean(from - reach, from + reach)) / window_;
        a(r, c++) = turning_->mean(from, to);
      }
      if (e_a_) a(r, c++) = e_a_->mean(from, to);
    }
    return a;
  }

  double place(std::size_t k, double offset, double drift) const {
    return log_.t[k] + offset + drift * (log_.t[k] - middle_);
  }

  const Series& log_;
  std::optional<Integral> omega_, turning_, e_a_;
  double begin_ = -1e300, end_ = 1e300;  // [s] of the run
  double window_ = 0, middle_ = 0;       // [s]
};

/// A place in the run, and what of the log it leaves unexplained.
struct Place {
  double offset = 0, drift = 0;
  Misfit misfit;

  double mean_square() const { return misfit.squares / static_cast<double>(misfit.readings); }
};

/// The whole run, window by window, without drift.
std::vector<Place> every_place(const Likeness& likeness) {
  std::vector<Place> all;
  const double step = coarse * likeness.window();
  for (double offset = likeness.first_offset(); offset <= likeness.last_offset(); offset += step) {
    if (const auto misfit = likeness.at(offset, 0, likeness.stride())) all.push_back({offset, 0, *misfit});
  }
  return all;
}

/// The place that explains most. @throws SessionError where that is too little
Place best_place(const std::vector<Place>& all) {
  if (all.empty()) throw SessionError("the log and the run overlap too little, or the log never changes");
  const Place best = *std::ranges::min_element(all, {}, [](const Place& p) { return p.misfit.share; });
  if (1 - best.misfit.share < least_explained) {
    std::ostringstream percent;
    percent.precision(3);
    percent << 100 * (1 - best.misfit.share);
    throw SessionError("the log does not look like the run anywhere: " + percent.str() +
                       " % of it explained at best. Is it of this run, and of the armature's current?");
  }
  return best;
}

/// What the best other place leaves unexplained; 1: there is none. @throws SessionError where it fits about as well
double unexplained_elsewhere(const std::vector<Place>& all, const Place& best, double window) {
  double other = 1;
  double other_at = 0;
  for (const Place& p : all) {
    if (std::abs(p.offset - best.offset) < near * window || p.misfit.share >= other) continue;
    other = p.misfit.share;
    other_at = p.offset;
  }
  const double likelihood = static_cast<double>(best.misfit.readings) * std::log(other / best.misfit.share);
  if (other < unlike * best.misfit.share || likelihood < evidence) {
    throw SessionError("the log fits about as well " + seconds(other_at - best.offset) +
                       " away: the run repeats itself. Record one that does not, with a step of another size or pause");
  }
  return other;
}

/// Offsets around the best one, each with every drift.
std::vector<Place> places_around(const Place& best, const Likeness& likeness) {
  std::vector<Place> all;
  const double reach = 2 * coarse * likeness.window() + most_drift * likeness.span() / 2;
  for (double drift = -most_drift; drift <= most_drift + drift_step / 2; drift += drift_step) {
    for (double offset = best.offset - reach; offset <= best.offset + reach; offset += fine * likeness.window()) {
      if (const auto misfit = likeness.at(offset, drift)) all.push_back({offset, drift, *misfit});
    }
  }
  return all;
}

/// The one of least squares a reading; the first look's where none is better.
Place closest(const std::vector<Place>& all, const Place& first) {
  Place least = first;
  for (const Place& p : all) {
    if (p.misfit.squares * static_cast<double>(least.misfit.readings) <
        least.misfit.squares * static_cast<double>(p.misfit.readings)) {
      least = p;
    }
  }
  return least;
}

/// The offset of least squares among those without drift.
double offset_without_drift(const std::vector<Place>& all, double otherwise) {
  double lowest = std::numeric_limits<double>::infinity();
  double offset = otherwise;
  for (const Place& p : all) {
    if (std::abs(p.drift) > drift_step / 2 || p.mean_square() >= lowest) continue;
    lowest = p.mean_square();
    offset = p.offset;
  }
  return offset;
}

/// Where the log belongs, by the places around: how far each of offset and drift may go before the sum of squares rises
/// by its own variance. A drift that may go as far as crystals do cannot be told.
void set_place(LogAlignment& found, const std::vector<Place>& around, const Place& first, double window) {
  const Place least = closest(around, first);
  const auto n = static_cast<double>(least.misfit.readings);
  const double allowed = least.misfit.squares / n * (1 + 1 / std::max(n - fitted, 1.0));
  found.offset = least.offset;
  found.drift = least.drift;
  found.offset_error = model_error * window;
  double low = found.drift;
  double high = found.drift;
  for (const Place& p : around) {
    if (p.mean_square() > allowed) continue;
    found.offset_error = std::max(found.offset_error, std::abs(p.offset - found.offset));
    low = std::min(low, p.drift);
    high = std::max(high, p.drift);
  }
  if (low <= -most_drift + drift_step / 2 || high >= most_drift - drift_step / 2) {
    found.drift = 0;
    found.offset = offset_without_drift(around, found.offset);
  } else {
    found.drift_error = std::max((high - low) / 2, drift_step / 2);
  }
}

}  // namespace

LogAlignment align_log(const Run& run, const Series& log) {
  const Likeness likeness(run, log);
  const std::vector<Place> all = every_place(likeness);
  const Place best = best_place(all);
  LogAlignment found{.middle = likeness.middle(), .explained = 1 - best.misfit.share};
  found.runner_up = 1 - unexplained_elsewhere(all, best, likeness.window());
  set_place(found, places_around(best, likeness), best, likeness.window());
  if (const auto there = likeness.at(found.offset, found.drift)) found.explained = 1 - there->share;
  return found;
}

Series placed(const Run& run, const Series& log, const LogAlignment& at) {
  Series series;
  series.window = log.window;
  series.lsb = log.lsb;
  series.source = log.source;
  const double end = run.duration();
  for (std::size_t k = 0; k < log.t.size(); ++k) {
    const double t = at.time(log.t[k]);
    if (t - log.window < 0 || t > end) continue;
    series.t.push_back(t);
    series.value.push_back(log.value[k]);
  }
  return series;
}

}  // namespace emtb
