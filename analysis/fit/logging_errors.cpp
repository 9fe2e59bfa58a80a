#include "analysis/fit/logging_errors.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "analysis/fit/residuals.h"
#include "analysis/fit/starts.h"
#include "analysis/numerics/linear_algebra.h"
#include "analysis/record/dataset.h"
#include "model/lateness.h"

namespace emtb {
namespace {

/// The instruments that may be read a part of a sample late for all that the model says.
std::vector<Signal> of_unknown_lateness(std::span<const Record> records, const Model& model) {
  std::vector<Signal> signals;
  for (const Record& record : records) {
    for (const Observation& o : record.observations) {
      if (o.slow || o.signal == Signal::e_a || says_how_late(model.structure(), o.signal)) continue;
      if (std::ranges::find(signals, o.signal) == signals.end()) signals.push_back(o.signal);
    }
  }
  return signals;
}

/// The timing of a record, with each instrument by so much of a sample later, or earlier where it is late.
Timing shifted(const Record& record, double by) {
  Timing timing{record.excitation.acts_after, record.excitation.e_a_held, record.excitation.rows_early};
  timing.meters_at_once = std::ranges::any_of(record.observations, &Observation::at_once);
  for (const Observation& o : record.observations) timing.late[o.signal] = o.late + (o.late > by ? -by : by);
  return timing;
}

/// What the records say of parameters S and of what is not known of logging D together: the lateness of each
/// instrument, then the starts.
struct Sums {
  Eigen::MatrixXd ss, sd, dd;
};

/// Adds what a record says.
/// @param record is left with another timing @param first_start column of its start
void add(Sums& sums, Record& record, const Model& model, const std::vector<Signal>& signals, Eigen::Index first_start) {
  constexpr double by = 0.1;  // of a sample: the prediction is a straight line of it up to where a voltage jumps
  constexpr Eigen::Index at_once = 4096;  // readings: the slopes of an hour's are never held side by side
  const std::span<const Record> alone(&record, 1);
  const ModelStructure structure = record.structure(model);
  const std::vector<double> values = model.values();
  const FreeParameters free(model);
  const std::vector<Residuals> now = residuals(alone, 0, structure, values, moved_by(free));
  const auto starts = slopes_of_start(record, model);
  std::vector<double> late;
  for (const Residuals& r : now) late.push_back(record.find(r.signal)->late);
  set_timing(std::span(&record, 1), shifted(record, by));
  const std::vector<Residuals> then = residuals(alone, 0, structure, values, {});
  for (std::size_t k = 0; k < now.size(); ++k) {
    const auto signal = std::ranges::find(signals, now[k].signal);
    const Observation& o = *record.find(now[k].signal);
    if (now[k].informed()) sums.ss += gram(now[k].sensitivity);
    for (Eigen::Index first = 0; first < now[k].value.size(); first += at_once) {
      const Eigen::Index count = std::min(at_once, now[k].value.size() - first);
      const auto part = [&](const Eigen::VectorXd& of_all) { return of_all.segment(first, count); };
      Eigen::MatrixXd d = Eigen::MatrixXd::Zero(count, sums.dd.cols());
      if (signal != signals.end() && !o.slow)
        d.col(signal - signals.begin()) = (part(then[k].value) - part(now[k].value)) / (o.late - late[k]);
      for (std::size_t s = 0; s < starts.size(); ++s)
        d.col(first_start + static_cast<Eigen::Index>(s)) = part(starts[s][k]);
      sums.dd += gram(d);
      if (now[k].informed()) sums.sd += transposed_product(now[k].sensitivity.middleRows(first, count), d);
    }
  }
}

/// @param starts how much is not known of the start of each record
Sums sums_of(std::span<const Record> records, const Model& model, const std::vector<Signal>& signals,
             const std::vector<Eigen::Index>& starts) {
  const auto p = static_cast<Eigen::Index>(FreeParameters(model).size());
  auto n = static_cast<Eigen::Index>(signals.size());
  Eigen::Index start = n;
  for (const Eigen::Index of_record : starts) n += of_record;
  Sums sums{Eigen::MatrixXd::Zero(p, p), Eigen::MatrixXd::Zero(p, n), Eigen::MatrixXd::Zero(n, n)};
  for (std::size_t i = 0; i < records.size(); ++i) {
    Record record = records[i];
    add(sums, record, model, signals, start);
    start += starts[i];
  }
  return sums;
}

}  // namespace

void widen_by_logging(std::span<const Record> records, Calibration& fit) {
  constexpr double even_chance = 12;  // 1/variance, over a sample
  constexpr double not_told = 1e-9;   // of what a start says by itself: else the parameters say the same
  const std::vector<Signal> signals = of_unknown_lateness(records, fit.model);
  std::vector<Eigen::Index> starts;
  for (const Record& record : records) starts.push_back(unknowns_of_start(record, fit.model));
  const bool any_start = std::ranges::any_of(starts, [](Eigen::Index n) { return n > 0; });
  const FreeParameters free(fit.model);
  if ((signals.empty() && !any_start) || free.size() == 0 || fit.inflation.size() == 0) return;
  const Sums sums = sums_of(records, fit.model, signals, starts);
  const Eigen::MatrixXd goes_with = solve_normal(sums.ss, sums.sd);
  Eigen::MatrixXd known = (sums.dd - sums.sd.transpose() * goes_with) / std::max(1.0, fit.inflation.maxCoeff());
  const auto late = static_cast<Eigen::Index>(signals.size());
  known.diagonal().head(late).array() += even_chance;
  known.diagonal().tail(known.rows() - late) += not_told * sums.dd.diagonal().tail(known.rows() - late);
  const Eigen::MatrixXd variance = goes_with * solve_normal(known, Eigen::MatrixXd(goes_with.transpose()));
  for (std::size_t k = 0; k < free.size(); ++k) {
    std::optional<double>& error = fit.model.at(free.places()[k]).std_error;
    const auto i = static_cast<Eigen::Index>(k);
    if (error) error = std::sqrt(*error * *error + std::max(0.0, variance(i, i)));
  }
}

}  // namespace emtb
