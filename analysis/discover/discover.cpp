#include "analysis/discover/discover.h"

#include <algorithm>
#include <cmath>

#include "analysis/diagnose/remainder.h"
#include "analysis/fit/gauge.h"
#include "analysis/fit/starts.h"
#include "analysis/fit/timing.h"

namespace emtb {
namespace {

/// The model as given, fitted as a diagnosis does: with what the data cannot tell held, and the timing settled.
Trial fitted_base(FittedTrials& trials, Dataset& data, const Model& given) {
  Trial first = trials.first_fit(given);
  const std::vector<std::size_t> places = places_to_hold(data.train, first.model());
  if (!places.empty()) first = trials.first_fit(hold(data.train, given, first.model(), places));
  const bool timing = settle_timing(data, first.model()) != TimingChange::none;
  if (settle_starts(data, first.model()) || timing) {
    if (auto again = trials.fit_to_the_end(first.model())) first = std::move(*again);
  }
  return first;
}

}  // namespace

Discovery discover(std::span<const Run> train, std::span<const Run> held_out, const Model& model,
                   const DiscoverOptions& options) {
  const auto progress = [&](double share, const std::string& doing) {
    if (options.progress) options.progress(share, doing);
  };
  Discovery d;
  progress(0.05, "fitting the model as given");
  Dataset data = prepare(train, held_out, model);
  std::vector<Record> confirm;
  const Model given = without_pins(model);
  const MaterialityCriterion criterion{Materiality{}};
  const ScoreOptions score;
  FittedTrials trials(data, given, criterion, score, 8);
  Trial base = fitted_base(trials, data, given);
  d.worth_a_name = worth_a_name(data, base.model(), base.held_out, {});
  if (data.held_out.size() >= 2) {
    const auto shortest = std::ranges::min_element(data.held_out, {}, &Record::length);
    confirm.push_back(std::move(*shortest));
    data.held_out.erase(shortest);
    if (auto again = trials.fit(base.model(), nullptr)) base = std::move(*again);
  }
  d.confirmed_by = confirm.size();
  d.judged_on_training = data.held_out.empty() && data.train.size() == 1;
  d.fitted = with_standard_errors(data.train, base.model()).model;
  d.train = base.train;
  d.held_out = base.held_out.error();
  for (const Signal signal : base.held_out.signals()) {
    d.rmse[signal] = std::sqrt(base.held_out.mean_square(signal)) * data.noise.at(signal).sigma;
  }
  progress(0.3, "smoothing what is left");
  d.left = what_is_left(data.train, base.model());
  d.torque = shares_of(d.left, false);
  if (d.left.voltage_seen) d.voltage = shares_of(d.left, true);
  progress(0.5, "searching a law");
  if (d.worth_a_name && !d.judged_on_training) {
    d.law = find_law(data, base, given, criterion, confirm, d.left, d.torque, d.voltage, options.read);
  }
  progress(0.8, "asking whether it is the same machine");
  const Model& best = d.law ? d.law->model : base.model();
  d.changed = changed_runs(data.train, best);
  d.disturbances = disturbances_in(d.law ? what_is_left(data.train, best) : d.left);
  progress(1, "done");
  return d;
}

}  // namespace emtb
