#include "analysis/record/log_alignment.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <sstream>

#include "analysis/numerics/linear_algebra.h"
#include "hal/error.h"

namespace emtb {
namespace {

constexpr std::size_t fewest = 12;       // readings: twice what is fitted
constexpr double overlap = 0.6;          // of the shorter of run and log
constexpr double coarse = 0.25;          // windows, from offset to offset
constexpr double fine = 0.025;           // windows
constexpr double near = 2;               // windows: closer is the same place
constexpr double least_explained = 0.8;  // of the log's variance
constexpr double unlike = 1.5;           // times what is unexplained, at any other place
constexpr double evidence = 12;          // and of twice the log likelihood: 3.5 sigma
constexpr double most_drift = 500e-6;    // of two crystals, one of them hot
constexpr double drift_step = 50e-6;
constexpr double model_error = 0.05;  // windows: what standing friction and heating shift the place by
constexpr std::size_t enough = 200;   // readings for a first look
constexpr double turning = 2;         // [rad/s] below, the machine may stand

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
  std::vector<double> t_, sum_;
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
    std::ranges::nth_element(spacing, spacing.begin() + static_cast<std::ptrdiff_t>(spacing.size() / 2));
    window_ = log.window > 0 ? log.window : spacing[spacing.size() / 2];
    middle_ = (log.t.front() + log.t.back()) / 2;
  }

  double window() const { return window_; }
  double middle() const { return middle_; }
  std::size_t stride() const { return std::max<std::size_t>(log_.t.size() / enough, 1); }
  double first_offset() const { return begin_ - log_.t.back(); }
  double last_offset() const { return end_ - log_.t.front(); }

  /// @return nothing where too little of the log lies in the run
  std::optional<Misfit> at(double offset, double drift, std::size_t stride = 1) const {
    const double reach = window_ / 10;  // a speed's change is that of its means over so long
    std::vector<std::size_t> inside;
    for (std::size_t k = 0; k < log_.t.size(); k += stride) {
      const double t = place(k, offset, drift);
      if (t - window_ - reach >= begin_ && t + reach <= end_) inside.push_back(k);
    }
    const double shorter = std::min(end_ - begin_, log_.t.back() - log_.t.front());
    if (inside.size() < fewest || log_.t[inside.back()] - log_.t[inside.front()] < overlap * shorter) {
      return std::nullopt;
    }
    const auto rows = static_cast<Eigen::Index>(inside.size());
    const Eigen::Index columns = 1 + (omega_ ? 3 : 0) + (e_a_ ? 1 : 0);
    Eigen::MatrixXd a(rows, columns);
    Eigen::VectorXd y(rows);
    for (Eigen::Index r = 0; r < rows; ++r) {
      const std::size_t k = inside[static_cast<std::size_t>(r)];
      const double to = place(k, offset, drift);
      const double from = to - window_;
      y[r] = log_.value[k];
      Eigen::Index c = 0;
      a(r, c++) = 1;
      if (omega_) {
        a(r, c++) = omega_->mean(from, to);
        a(r, c++) = (omega_->mean(to - reach, to + reach) - omega_->mean(from - reach, from + reach)) / window_;
        a(r, c++) = turning_->mean(from, to);
      }
      if (e_a_) a(r, c++) = e_a_->mean(from, to);
    }
    const double total = (y.array() - y.mean()).square().sum();
    if (!(total > 0)) return std::nullopt;
    const Eigen::VectorXd fitted = product(a, least_squares(a, y));
    const double squares = (y - fitted).squaredNorm();
    return Misfit{.share = squares / total, .squares = squares, .readings = inside.size()};
  }

 private:
  void limit(const Series& series) {
    if (series.t.size() < fewest) throw SessionError("the run is too short to place a log in it");
    begin_ = std::max(begin_, series.t.front());
    end_ = std::min(end_, series.t.back());
  }
  double place(std::size_t k, double offset, double drift) const {
    return log_.t[k] + offset + drift * (log_.t[k] - middle_);
  }

  const Series& log_;
  std::optional<Integral> omega_, turning_, e_a_;
  double begin_ = -1e300, end_ = 1e300;  // [s] of the run
  double window_ = 0, middle_ = 0;       // [s]
};

struct Candidate {
  double offset = 0;
  Misfit misfit;
};

std::vector<Candidate> every_place(const Likeness& likeness) {
  std::vector<Candidate> all;
  const double step = coarse * likeness.window();
  for (double offset = likeness.first_offset(); offset <= likeness.last_offset(); offset += step) {
    if (const auto misfit = likeness.at(offset, 0, likeness.stride())) all.push_back({offset, *misfit});
  }
  return all;
}

}  // namespace

LogAlignment align_log(const Run& run, const Series& log) {
  const Likeness likeness(run, log);
  const std::vector<Candidate> all = every_place(likeness);
  if (all.empty()) throw SessionError("the log and the run overlap too little, or the log never changes");
  const auto share = [](const Candidate& c) { return c.misfit.share; };
  const Candidate best = *std::ranges::min_element(all, {}, share);
  if (1 - best.misfit.share < least_explained) {
    std::ostringstream percent;
    percent.precision(3);
    percent << 100 * (1 - best.misfit.share);
    throw SessionError("the log does not look like the run anywhere: " + percent.str() +
                       " % of it explained at best. Is it of this run, and of the armature's current?");
  }
  LogAlignment found{.middle = likeness.middle(), .explained = 1 - best.misfit.share};
  double other = 1;
  double other_at = 0;
  for (const Candidate& c : all) {
    if (std::abs(c.offset - best.offset) < near * likeness.window() || c.misfit.share >= other) continue;
    other = c.misfit.share;
    other_at = c.offset;
  }
  found.runner_up = 1 - other;
  const double likelihood = static_cast<double>(best.misfit.readings) * std::log(other / best.misfit.share);
  if (other < unlike * best.misfit.share || likelihood < evidence) {
    throw SessionError("the log fits about as well " + seconds(other_at - best.offset) +
                       " away: the run repeats itself. Record one that does not, with a step of another size or pause");
  }

  // Closer, with the drift; then how far each may go before the sum of squares rises by its own variance.
  Misfit least = best.misfit;
  found.offset = best.offset;
  std::vector<std::array<double, 3>> profile;  // offset, drift, squares
  const double reach = 2 * coarse * likeness.window() + most_drift * (log.t.back() - log.t.front()) / 2;
  for (double drift = -most_drift; drift <= most_drift + drift_step / 2; drift += drift_step) {
    for (double offset = best.offset - reach; offset <= best.offset + reach; offset += fine * likeness.window()) {
      const auto misfit = likeness.at(offset, drift);
      if (!misfit) continue;
      profile.push_back({offset, drift, misfit->squares / static_cast<double>(misfit->readings)});
      if (misfit->squares * static_cast<double>(least.readings) <
          least.squares * static_cast<double>(misfit->readings)) {
        least = *misfit;
        found.offset = offset;
        found.drift = drift;
      }
    }
  }
  const auto n = static_cast<double>(least.readings);
  const double allowed = least.squares / n * (1 + 1 / std::max(n - 7, 1.0));  // 5 coefficients, offset and drift
  double low = found.drift;
  double high = found.drift;
  found.offset_error = model_error * likeness.window();
  for (const auto& [offset, drift, squares] : profile) {
    if (squares > allowed) continue;
    found.offset_error = std::max(found.offset_error, std::abs(offset - found.offset));
    low = std::min(low, drift);
    high = std::max(high, drift);
  }
  if (low <= -most_drift + drift_step / 2 || high >= most_drift - drift_step / 2) {
    found.drift = 0;  // any would do
    double lowest = std::numeric_limits<double>::infinity();
    for (const auto& [offset, drift, squares] : profile) {
      if (std::abs(drift) > drift_step / 2 || squares >= lowest) continue;
      lowest = squares;
      found.offset = offset;
    }
  } else {
    found.drift_error = std::max((high - low) / 2, drift_step / 2);
  }
  const auto there = likeness.at(found.offset, found.drift);
  if (there) found.explained = 1 - there->share;
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
