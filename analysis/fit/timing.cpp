#include "analysis/fit/timing.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "analysis/fit/circumstances.h"
#include "analysis/fit/cost_of_lateness.h"
#include "analysis/fit/logging_errors.h"
#include "analysis/fit/residuals.h"
#include "analysis/fit/starts.h"
#include "analysis/numerics/even_series.h"
#include "analysis/numerics/linear_algebra.h"
#include "model/lateness.h"

namespace emtb {
namespace {

/// Of a sample: a change that acts just before the readings of its row.
constexpr double just_before = -1e-3;

/// Of a sample: an instrument that is behind the others by less is not.
constexpr double least_late = 0.02;

/// Can it be told at all when an input acts? A motor that is driven by a measured voltage does not see the reference.
bool sees_its_input(const Record& record, const Model& model) {
  return model.input != Signal::u_ref || !record.measured_voltage;
}

/// Says the model itself how late a signal is? Terminals that are read behind the reference are a driver's matter.
bool models_lateness(const Model& model, Signal signal) {
  return signal == Signal::e_a || says_how_late(model.structure(), signal);
}

/// How much more the residuals of each signal jump from reading to reading than an instrument's would, at least 1: what
/// a model of a brake that lets go a little late is off by has nothing to say about timing, however large it is.
std::map<Signal, double> jumpiness(std::span<const Residuals> residuals) {
  std::map<Signal, double> squares, count, more;
  for (const Residuals& r : residuals) {
    if (r.value.size() < 2) continue;
    const auto n = r.value.size() - 1;
    squares[r.signal] += (r.value.tail(n) - r.value.head(n)).squaredNorm();
    count[r.signal] += 2.0 * static_cast<double>(n);
  }
  for (const Residuals& r : residuals) {
    more[r.signal] = count[r.signal] > 0 ? std::max(1.0, std::sqrt(squares[r.signal] / count[r.signal])) : 1;
  }
  return more;
}

/// Noise of a measured voltage reaches the current that is predicted from it, but a late reading of that, between two
/// of the voltage's, has the mean of two noises: it leaves less, whether the instrument is late or not. How much less
/// of the sum of squares, over x (1 - x) at x samples.
double noise_averaged(const Record& record, const Observation& o, const Model& model) {
  const InputNoise& noise = record.voltage_noise;
  if (o.signal != Signal::i_a || o.slow || noise.change.empty()) return 0;
  const double R_a = model.values()[base::R_a];
  double sum = 0;
  for (std::size_t i = 0; i < o.size(); ++i) sum += std::pow(noise.change[o.last[i]] / R_a / o.sigma[i], 2);
  return sum;
}

/// [samples] How late a signal is by the window that its instrument is stated to average over.
double late_by_window(std::span<const Record> records, Signal signal) {
  for (const Record& record : records) {
    if (const Observation* o = record.find(signal)) return o->late_by_window(mean_interval(record.excitation.t));
  }
  return 0;
}

/// Are there slow meters of which nobody said whether they average?
bool has_meters(std::span<const Record> records) {
  return std::ranges::any_of(
      records, [](const Record& record) { return std::ranges::any_of(record.observations, may_read_at_once); });
}

class TimingSearch {
 public:
  TimingSearch(std::vector<Record> records, const Model& fitted)
      : model_(fitted), values_(fitted.values()), records_(std::move(records)) {
    const FreeParameters free(fitted);
    const auto moved = moved_by(free);
    known_ = emtb::residuals(records_, fitted, values_, moved);
    free_starts();
    scale_ = jumpiness(known_);
    for (const Record& record : records_) {
      for (const Observation& o : record.observations)
        averaged_[o.signal] += noise_averaged(record, o, fitted) / std::pow(scale_.at(o.signal), 2);
    }
    for (Residuals& r : known_) {
      if (!r.informed()) continue;
      if (sts_.size() == 0) sts_.setZero(r.sensitivity.cols(), r.sensitivity.cols());
      r.sensitivity /= scale_.at(r.signal);
      sts_ += gram(r.sensitivity);
    }
    for (Residuals& r : known_) r.value.resize(0);
  }

  double cost(const Timing& timing) {
    const std::vector<Residuals> left = residuals(timing);
    const Eigen::VectorXd gradient = gradient_of(left);
    const double taken = sts_.rows() > 0 ? gradient.dot(solve_normal(sts_, gradient).col(0)) : 0;
    return 0.5 * (sum_of_squares(left) - taken);
  }

  /// By which part of a sample each instrument is behind the others.
  /// @param clear of half the sum of squares that it has to take away
  /// @param together by which part all of them may be late: what is more is no matter of logging
  std::map<Signal, double> late(const Timing& timing, double clear, double together) {
    std::vector<Signal> signals;
    bool all = true;  // of the instruments are asked
    for (const Residuals& r : known_) {
      if (models_lateness(model_, r.signal)) {
        all = false;
      } else if (std::ranges::find(signals, r.signal) == signals.end()) {
        signals.push_back(r.signal);
      }
    }
    const CostOfLateness cost = cost_of_lateness(timing, signals);
    std::vector<char> held(signals.size(), 0);
    std::vector<double> late = cost.least(held);
    // Each by itself against the others: a nuisance is free, but not for a crumb.
    for (std::size_t c = 0; c < signals.size(); ++c) {
      held[c] = 1;
      std::vector<double> without = cost.least(held);
      if (late[c] < least_late || cost.at(without) - cost.at(late) < clear ||
          news_of(with(timing, signals, late), with(timing, signals, without)) < clear) {
        late = std::move(without);
      } else {
        held[c] = 0;
      }
    }
    if (const auto least = std::ranges::min_element(late); all && least != late.end() && *least > together) {
      held[static_cast<std::size_t>(least - late.begin())] = 1;
      late = cost.least(held);
    }
    std::map<Signal, double> found;
    for (std::size_t c = 0; c < signals.size(); ++c) {
      const double by_window = late_by_window(records_, signals[c]);
      std::vector<double> as_stated = late;
      as_stated[c] = by_window;
      if (by_window > 0 && !(cost.at(as_stated) - cost.at(late) > clear &&
                             news_of(with(timing, signals, late), with(timing, signals, as_stated)) > clear)) {
        late = std::move(as_stated);
      } else if (late[c] > 0 || by_window > 0) {
        found[signals[c]] = late[c];
      }
    }
    return found;
  }

  /// Half the sum of squares that one timing has less than another, of what each residual adds to the one before it:
  /// where residuals remember, to leave a little less of them for a while says little.
  double news_of(const Timing& better, const Timing& worse) {
    std::vector<Residuals> left = residuals(better), more = residuals(worse);
    leave_to_parameters(left);
    leave_to_parameters(more);
    double gained = 0;
    for (std::size_t i = 0; i < left.size(); ++i) {
      const Eigen::VectorXd& r = left[i].value;
      const auto n = r.size() - 1;
      if (n < 1) continue;
      const double memory = std::clamp(r.head(n).dot(r.tail(n)) / std::max(r.squaredNorm(), 1e-300), 0.0, 0.99);
      const auto news = [&](const Eigen::VectorXd& of) { return (of.tail(n) - memory * of.head(n)).squaredNorm(); };
      const double expected = std::max(news(r) / static_cast<double>(n), 1 - memory * memory);
      gained += 0.5 * (news(more[i].value) - news(r)) / expected;
    }
    for (const auto& [signal, late] : better.late) gained -= 0.5 * by_averaging(signal, late);
    for (const auto& [signal, late] : worse.late) gained += 0.5 * by_averaging(signal, late);
    return gained;
  }

 private:
  /// What is not known of how the runs begin is as free as the parameters: a start that is a little off decays as the
  /// error of a timing does.
  void free_starts() {
    std::vector<std::vector<std::vector<Eigen::VectorXd>>> slopes;  // of each record
    Eigen::Index more = 0, p = 0;
    for (Record& record : records_) {
      slopes.push_back(slopes_of_start(record, model_));
      more += static_cast<Eigen::Index>(slopes.back().size());
    }
    if (more == 0) return;
    for (const Residuals& r : known_) p = std::max(p, r.sensitivity.cols());
    Eigen::Index column = p;
    std::size_t first = 0;  // residual of its record
    for (std::size_t i = 0; i < records_.size(); ++i) {
      std::size_t end = first;
      for (; end < known_.size() && known_[end].record == i; ++end) {
        Eigen::MatrixXd wider = Eigen::MatrixXd::Zero(known_[end].value.size(), p + more);
        if (known_[end].informed()) wider.leftCols(p) = known_[end].sensitivity;
        for (std::size_t s = 0; s < slopes[i].size(); ++s)
          wider.col(column + static_cast<Eigen::Index>(s)) = slopes[i][s][end - first];
        known_[end].sensitivity = std::move(wider);
      }
      column += static_cast<Eigen::Index>(slopes[i].size());
      first = end;
    }
  }

  /// What a signal loses of its sum of squares whenever it is read late.
  double by_averaging(Signal signal, double late) const {
    const auto found = averaged_.find(signal);
    return found != averaged_.end() ? found->second * late * (1 - late) : 0;
  }

  static Timing with(Timing timing, const std::vector<Signal>& signals, const std::vector<double>& late) {
    for (std::size_t c = 0; c < signals.size(); ++c) timing.late[signals[c]] = late[c];
    return timing;
  }

  /// Of the parameters, by what is left of all signals.
  Eigen::VectorXd gradient_of(std::span<const Residuals> all) const {
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(sts_.rows());
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (known_[i].informed()) gradient += transposed_product(known_[i].sensitivity, all[i].value);
    }
    return gradient;
  }

  /// Takes away what the parameters would take.
  void leave_to_parameters(std::vector<Residuals>& all) const {
    if (sts_.rows() == 0) return;
    const Eigen::VectorXd step = solve_normal(sts_, gradient_of(all));
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (known_[i].informed()) all[i].value -= product(known_[i].sensitivity, Eigen::MatrixXd(step));
    }
  }

  CostOfLateness cost_of_lateness(Timing timing, const std::vector<Signal>& signals) {
    const Eigen::VectorXd none = Eigen::VectorXd::Zero(sts_.rows());
    std::vector<CostOfLateness::OfSignal> sums(signals.size());
    for (auto& of : sums) of.gradients.fill(none);
    Eigen::VectorXd other = none;
    std::vector<Residuals> before;
    for (std::size_t place = 0; place <= CostOfLateness::places; ++place) {
      for (const Signal signal : signals) timing.late[signal] = static_cast<double>(place) / CostOfLateness::places;
      std::vector<Residuals> here = residuals(timing);
      for (std::size_t i = 0; i < here.size(); ++i) {
        const auto add_gradient = [&](Eigen::VectorXd& to) {
          if (known_[i].informed()) to += transposed_product(known_[i].sensitivity, here[i].value);
        };
        const auto signal = std::ranges::find(signals, here[i].signal);
        if (signal == signals.end()) {
          if (place == 0) add_gradient(other);
          here[i].value.resize(0);  // no longer needed, and an hour's are large
          continue;
        }
        CostOfLateness::OfSignal& of = sums[static_cast<std::size_t>(signal - signals.begin())];
        add_gradient(of.gradients[place]);
        of.squares[place] += here[i].value.squaredNorm();
        if (place > 0) of.products[place - 1] += before[i].value.dot(here[i].value);
      }
      before = std::move(here);
    }
    for (std::size_t c = 0; c < signals.size(); ++c) {
      const auto averaged = [&](std::size_t place) {
        return by_averaging(signals[c], static_cast<double>(place) / CostOfLateness::places);
      };
      for (std::size_t place = 0; place <= CostOfLateness::places; ++place) {
        sums[c].squares[place] += averaged(place);
        if (place > 0) sums[c].products[place - 1] += 0.5 * (averaged(place - 1) + averaged(place));
      }
    }
    return {std::move(sums), sts_, std::move(other)};
  }

  std::vector<Residuals> residuals(const Timing& timing) {
    set_timing(records_, timing);
    std::vector<Residuals> all = emtb::residuals(records_, model_, values_, {});
    for (Residuals& r : all) r.value /= scale_.at(r.signal);
    return all;
  }

  const Model& model_;
  std::vector<double> values_;
  std::vector<Record> records_;
  std::vector<Residuals> known_;  ///< as recorded: the sensitivities, without the values
  std::map<Signal, double> scale_, averaged_;
  Eigen::MatrixXd sts_;
};

/// A voltage that holds from row to row, and one that goes straight from reading to reading, lead to parameters so far
/// from each other that no straight line of them leads from the ones to the others: each is fitted.
/// @param records whose timing becomes that which leaves clearly less @return fitted to it
Model with_voltage_held_or_straight(std::vector<Record>& records, const Model& fitted, double clear) {
  const CalibrationOptions quick{.extra_starts = 0, .max_iterations = 15, .tolerance = 1e-4, .with_covariance = false};
  const Timing as_set{records.front().excitation.acts_after, records.front().excitation.e_a_held};
  const auto fit_to = [&](const Timing& timing) {
    set_timing(records, timing);
    return fit_or_none(records, fitted, quick);
  };
  const Timing other = as_set.held ? Timing{} : Timing{0, true};
  const Fit there = fit_to(other), here = fit_to(as_set);
  if (!(there.cost + clear < here.cost)) return fitted;
  set_timing(records, other);
  return there.model;
}

}  // namespace

Timing fitted_timing(std::span<const Record> records, const Model& fitted) {
  constexpr double clear = 10;  // of half the sum of squares: a nuisance is free, but not for a crumb
  constexpr std::array shares{just_before, -0.25, -0.5, -0.75, -1.0, 0.25, 0.5, 0.75, 1.0};  // of a sample
  std::vector<Record> seen;
  for (const Record& record : records) {
    if (sees_its_input(record, fitted)) seen.push_back(record);
  }
  const bool input_is_seen = !seen.empty();
  if (!input_is_seen) seen.assign(records.begin(), records.end());
  const double interval = mean_interval(seen.front().excitation.t);
  const bool held = input_is_seen && fitted.input == Signal::e_a;
  const Model told_by = held ? with_voltage_held_or_straight(seen, fitted, clear) : fitted;
  TimingSearch search(std::move(seen), told_by);
  Timing best;  // where the voltage is measured, that told the rest (record/reference_row.h)
  if (!input_is_seen) best.acts_after = records.front().excitation.acts_after;
  double least = search.cost(best) - clear;
  const auto look_at = [&](const Timing& timing) {
    const double cost = search.cost(timing);
    if (!(cost < least)) return;
    least = cost;
    best = timing;
  };
  // Where an effect says how late the edges come, they may still come before their row is read.
  const bool late_is_told = shapes_edges(fitted.structure());
  const auto with_late = [&](Timing timing) {
    // A reference is not read by an instrument that could be late as well: the others are late together by what is left
    // of a sample, and by nothing where an effect tells it.
    const bool set_from_outside = input_is_seen && fitted.input == Signal::u_ref;
    const double left_of_a_sample = !set_from_outside ? 1 : late_is_told ? 0 : 1 - timing.acts_after / interval;
    timing.late = search.late(timing, clear, left_of_a_sample + least_late);
    return timing;
  };
  const bool meters = has_meters(records);
  const auto with_meters = [&](const Timing& timing) {
    Timing at_once = timing;
    at_once.meters_at_once = true;
    const bool told = meters && search.cost(at_once) < search.cost(timing) - clear;
    return told && search.news_of(at_once, timing) > clear ? at_once : timing;
  };
  if (held) look_at({0, true});
  if (!input_is_seen) return with_meters(with_late(best));
  for (const double share : shares) {
    if (share < 0 || !late_is_told) look_at({share * interval, held});
  }
  // Of what was written a row behind, the reading of the row before may have been taken after it acted, too.
  look_at({.acts_after = just_before * interval, .held = held, .rows_early = 1});
  if (std::abs(best.acts_after) > 0.1 * interval) {  // between the places tried: twice as near, twice
    for (double step = 0.125; step > 0.05; step /= 2) {
      const double from = best.acts_after / interval;
      for (const double share : {from - step, from + step}) {
        if (std::abs(share) <= 1 && (share < 0 || !late_is_told)) look_at({share * interval, held});
      }
    }
  }
  if (search.news_of(best, {}) < clear) best = {};
  best = with_late(best);
  // Edges in the middle of a row are rare, and an instrument that is behind looks like them: with it in its place, a
  // row is read before it is written, or after, unless the readings speak against both.
  const double place = best.acts_after / interval;
  if (place == 0 || (place == just_before && best.rows_early == 0)) return with_meters(best);
  constexpr double good_to = 0.1;  // what parameters take is a straight line of them, and they have far to go
  double most = search.cost(best) * (1 + good_to) + clear;
  Timing usual = best;
  const auto rather = [&](const Timing& at_a_row) {
    const Timing timing = with_late(at_a_row);
    if (const double cost = search.cost(timing); cost < most) {
      most = cost;
      usual = timing;
    }
  };
  if (held) rather({});  // straight from reading to reading
  if (!late_is_told) rather({0, held});
  rather({just_before * interval, held});
  if (usual == best) rather({-interval, held});  // read before it is written, and written with the next row
  return with_meters(usual);
}

Timing timing_as_recorded(const Timing& timing) {
  Timing recorded{.voltage_late = timing.voltage_late, .lags_in_itself = timing.lags_in_itself};
  if (const auto terminals = timing.late.find(Signal::e_a); terminals != timing.late.end())
    recorded.late.insert(*terminals);
  return recorded;
}

TimingChange settle_timing(Dataset& data, const Model& fitted) {
  constexpr double same = 0.1;  // of a sample: what a search on a grid of sixteenths may differ by
  Timing timing = fitted_timing(data.train, fitted);
  const Timing& before = data.timing;
  Timing recorded = timing_as_recorded(before);
  timing.voltage_late = recorded.voltage_late;
  timing.lags_in_itself = recorded.lags_in_itself;
  timing.late.merge(recorded.late);
  const double interval = mean_interval(data.train.front().excitation.t);
  const auto late = [&](const Timing& of, Signal signal) {
    const auto found = of.late.find(signal);
    return found != of.late.end() ? found->second : late_by_window(data.train, signal);
  };
  const bool torque_loads = std::ranges::any_of(data.train, &Record::measured_load);
  double moved = 0, bends = 0;
  for (const Signal signal : all_signals()) {
    const double by = std::abs(late(timing, signal) - late(before, signal));
    moved = std::max(moved, by);
    if (signal != Signal::torque || !torque_loads) bends = std::max(bends, by);
  }
  const bool same_edges = timing.held == before.held && timing.rows_early == before.rows_early &&
                          timing.meters_at_once == before.meters_at_once &&
                          (timing.acts_after < 0) == (before.acts_after < 0) &&
                          std::abs(timing.acts_after - before.acts_after) < same * interval;
  if (same_edges && moved < least_late) return TimingChange::none;
  if (same_edges) timing.acts_after = before.acts_after;
  set_timing(data, timing);
  return same_edges && bends < same ? TimingChange::slight : TimingChange::other;
}

void settle_as_it_stands(Dataset& data, const Model& model) {
  settle_starts(data, model);
  settle_timing(data, model);
  settle_starts(data, model);
}

namespace {

/// A fit, and how the runs are set that it is of.
struct Settled {
  Calibration fit;
  Circumstances circumstances;
};

/// Fitted as the runs are set, and once more at the timing and the starts that the fit tells: it was bent by others.
/// What leaves least on the way stands.
Settled fitted_by_turns(Dataset& data, const Model& start, const CalibrationOptions& options) {
  const auto fit_to_the_runs = [&](const Model& from) {
    return Settled{calibrate(std::span<const Record>(data.train), from, options), circumstances_of(data)};
  };
  Settled now = fit_to_the_runs(start);
  if (set_shorter_steps(data, now.fit.model)) now = fit_to_the_runs(now.fit.model);
  constexpr int some = 3, most = 12;
  constexpr double little = 0.01;  // of the cost: each bends the other a little less
  Settled best = now;
  bool goes_on = true;
  for (int again = 0; again < some || (goes_on && again < most); ++again) {
    const TimingChange timing = settle_timing(data, now.fit.model);
    const bool other_starts = settle_starts(data, now.fit.model);
    if (timing == TimingChange::none && !other_starts) break;
    now = fit_to_the_runs(now.fit.model);
    goes_on = now.fit.cost < (1 - little) * best.fit.cost;
    if (now.fit.cost < best.fit.cost) best = now;
    if (timing != TimingChange::other && !other_starts) break;
  }
  return best;
}

/// Does a model as it stands leave less than a fit, at the timing and the starts that it tells itself? They are set.
bool leaves_less_as_it_stands(Dataset& data, const Model& model, double cost_of_fit) {
  constexpr double hopeless = 9;  // times, three times the error: no timing takes as much from a first guess
  const auto cost = [&] {
    return fit_or_none(data.train, model, {.extra_starts = 0, .max_iterations = 0, .with_covariance = false}).cost;
  };
  if (!(cost() < hopeless * cost_of_fit)) return false;
  settle_as_it_stands(data, model);
  return cost() < cost_of_fit;
}

}  // namespace

Calibration calibrate(Dataset& data, const Model& model, const CalibrationOptions& options) {
  const Circumstances recorded = circumstances_of(data);
  Settled best = fitted_by_turns(data, model, options);
  set(data, recorded);
  if (leaves_less_as_it_stands(data, model, best.fit.cost)) {
    CalibrationOptions from_there = options;
    from_there.extra_starts = 0;
    best = fitted_by_turns(data, model, from_there);
  }
  set(data, best.circumstances);
  if (options.with_covariance) widen_by_logging(data.train, best.fit);
  return std::move(best.fit);
}

}  // namespace emtb
