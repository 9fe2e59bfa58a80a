#include "analysis/fit/timing.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "analysis/fit/residuals.h"
#include "analysis/numerics/even_series.h"
#include "analysis/numerics/linear_algebra.h"
#include "model/effect.h"

namespace emtb {
namespace {

/// Of a sample: a change that acts just before the readings of its row.
constexpr double just_before = -1e-3;

/// Can it be told at all when an input acts? A motor that is driven by a measured voltage does not see the reference.
bool sees_its_input(const Record& record, const Model& model) {
  return model.input != Signal::u_ref || !record.measured_voltage;
}

/// Says an effect of the model itself how late an edge comes?
bool models_edges(const Model& model) {
  return std::ranges::any_of(
      model.effects, [&](const IncludedEffect& e) { return model.about(e.effect).family == Family::driver_edges; });
}

class TimingSearch {
 public:
  TimingSearch(std::vector<Record> records, const Model& fitted)
      : model_(fitted), values_(fitted.values()), records_(std::move(records)) {
    const FreeParameters free(fitted);
    const auto moved = moved_by(free);
    const auto p = static_cast<Eigen::Index>(free.size());
    sts_.setZero(p, p);
    known_ = emtb::residuals(records_, fitted, values_, moved);
    for (const Residuals& r : known_) {
      if (r.informed()) sts_ += gram(r.sensitivity);
    }
  }

  double cost(const Timing& timing) {
    set_timing(records_, timing);
    const std::vector<Residuals> left = emtb::residuals(records_, model_, values_, {});
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(sts_.rows());
    double squares = 0;
    for (std::size_t i = 0; i < left.size(); ++i) {
      squares += left[i].value.squaredNorm();
      if (known_[i].informed()) gradient += transposed_product(known_[i].sensitivity, left[i].value);
    }
    const double taken = sts_.rows() > 0 ? gradient.dot(solve_normal(sts_, gradient).col(0)) : 0;
    return 0.5 * (squares - taken);
  }

 private:
  const Model& model_;
  std::vector<double> values_;
  std::vector<Record> records_;
  std::vector<Residuals> known_;
  Eigen::MatrixXd sts_;
};

}  // namespace

Timing fitted_timing(std::span<const Record> records, const Model& fitted) {
  constexpr double clear = 10;  // of half the sum of squares: a nuisance is free, but not for a crumb
  constexpr std::array shares{just_before, -0.25, -0.5, -0.75, 0.25, 0.5, 0.75, 1.0};  // of a sample
  std::vector<Record> seen;
  for (const Record& record : records) {
    if (sees_its_input(record, fitted)) seen.push_back(record);
  }
  if (seen.empty()) return {};
  const double interval = mean_interval(seen.front().excitation.t);
  TimingSearch search(std::move(seen), fitted);
  Timing best;
  double least = search.cost({}) - clear;
  const auto look_at = [&](const Timing& timing) {
    const double cost = search.cost(timing);
    if (!(cost < least)) return;
    least = cost;
    best = timing;
  };
  const bool held = fitted.input == Signal::e_a;
  if (held) look_at({0, true});
  if (models_edges(fitted)) return best;
  for (const double share : shares) look_at({share * interval, held});
  if (std::abs(best.acts_after) > 0.1 * interval) {  // between the places tried: twice as near, twice
    for (double step = 0.125; step > 0.05; step /= 2) {
      const double from = best.acts_after / interval;
      for (const double share : {from - step, from + step}) {
        if (std::abs(share) <= 1) look_at({share * interval, held});
      }
    }
  }
  return best;
}

bool settle_timing(Dataset& data, const Model& fitted) {
  constexpr double same = 0.1;  // of a sample: what a search on a grid of sixteenths may differ by
  const Timing timing = fitted_timing(data.train, fitted), &before = data.timing;
  const double interval = mean_interval(data.train.front().excitation.t);
  if (timing.held == before.held && (timing.acts_after < 0) == (before.acts_after < 0) &&
      std::abs(timing.acts_after - before.acts_after) < same * interval) {
    return false;
  }
  set_timing(data, timing);
  return true;
}

Calibration calibrate(Dataset& data, const Model& model, const CalibrationOptions& options) {
  Calibration fit = calibrate(std::span<const Record>(data.train), model, options);
  if (!settle_timing(data, fit.model)) return fit;
  return calibrate(std::span<const Record>(data.train), fit.model, options);
}

}  // namespace emtb
