#include "analysis/discover/discover.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "analysis/diagnose/remainder.h"
#include "analysis/fit/gauge.h"
#include "analysis/fit/starts.h"
#include "analysis/fit/timing.h"
#include "hal/error.h"

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

/// A model on runs, before anything is looked for.
class Fitted {
 public:
  Fitted(std::span<const Run> train, std::span<const Run> held_out, const Model& model)
      : data_(prepare(train, held_out, model)),
        given_(without_pins(model)),
        criterion_(Materiality{}),
        trials_(data_, given_, criterion_, score_, 8),
        base_(fitted_base(trials_, data_, given_)),
        worth_a_name_(emtb::worth_a_name(data_, base_.model(), base_.held_out, {})),
        all_(data_.all()) {
    if (data_.held_out.size() < 2) return;
    const auto shortest = std::ranges::min_element(data_.held_out, {}, &Record::length);
    confirm_.push_back(std::move(*shortest));
    data_.held_out.erase(shortest);
    if (auto again = trials_.fit(base_.model(), nullptr)) base_ = std::move(*again);
  }
  Fitted(const Fitted&) = delete;
  Fitted& operator=(const Fitted&) = delete;

  const Model& model() const { return base_.model(); }
  const Dataset& data() const { return data_; }
  const Trial& base() const { return base_; }
  std::span<const Record> all() const { return all_; }  ///< in the order of the runs, those that judge at the end
  std::size_t confirmed_by() const { return confirm_.size(); }
  bool worth_a_name() const { return worth_a_name_; }
  bool judged_on_training() const { return data_.held_out.empty() && data_.train.size() == 1; }

  std::optional<Law> law(const WhatIsLeft& left, const Shares& torque, const Shares& voltage,
                         const ReadFormula& read) const {
    if (!worth_a_name_ || judged_on_training()) return {};
    return find_law(data_, base_, given_, criterion_, confirm_, left, torque, voltage, read);
  }

 private:
  Dataset data_;
  Model given_;
  MaterialityCriterion criterion_;
  ScoreOptions score_;
  FittedTrials trials_;
  Trial base_;
  bool worth_a_name_ = false;
  std::vector<Record> all_, confirm_;
};

/// The model of one run of those that changed.
void set(Model& model, const Changed& c, std::size_t place_of_run) {
  const auto names = model.names();
  const auto place = std::ranges::find(names, c.parameter) - names.begin();
  const auto at = static_cast<double>(place_of_run) / static_cast<double>(std::max<std::size_t>(1, c.runs.size() - 1));
  model.at(static_cast<std::size_t>(place)).value = c.how == ChangeOf::drift ? c.from + at * (c.to - c.from) : c.to;
}

void look(const Fitted& fitted, Discovery& d, const DiscoverOptions& options) {
  d.worth_a_name = fitted.worth_a_name();
  d.confirmed_by = fitted.confirmed_by();
  d.judged_on_training = fitted.judged_on_training();
  d.fitted = with_standard_errors(fitted.data().train, fitted.model()).model;
  d.train = fitted.base().train;
  d.held_out = fitted.base().held_out.error();
  d.rmse.clear();
  for (const Signal signal : fitted.base().held_out.signals()) {
    d.rmse[signal] = std::sqrt(fitted.base().held_out.mean_square(signal)) * fitted.data().noise.at(signal).sigma;
  }
  d.left = what_is_left(fitted.data().train, fitted.model());
  d.torque = shares_of(d.left, false);
  d.voltage = d.left.voltage_seen ? shares_of(d.left, true) : Shares{};
  d.law = fitted.law(d.left, d.torque, d.voltage, options.read);
}

/// What stands out, with the values that runs of another machine have of their own: the model of all has bent to them.
std::vector<Disturbance> disturbances_beside(const Fitted& fitted, const Model& model,
                                             std::span<const Changed> changed) {
  std::vector<Model> models(fitted.all().size(), changed.empty() ? model : changed.back().others);
  for (const Changed& c : changed) {
    for (std::size_t r = 0; r < models.size(); ++r) {
      if (std::ranges::find(c.runs, fitted.all()[r].name) != c.runs.end()) set(models[r], c, r);
    }
  }
  return disturbances_in(what_is_left(fitted.all(), models));
}

}  // namespace

Discovery discover(std::span<const Run> train, std::span<const Run> held_out, const Model& model,
                   const DiscoverOptions& options) {
  const auto progress = [&](double share, const std::string& doing) {
    if (options.progress) options.progress(share, doing);
  };
  Discovery d;
  d.train_runs.assign(train.begin(), train.end());
  d.held_out_runs.assign(held_out.begin(), held_out.end());
  progress(0.05, "fitting the model as given");
  auto fitted = std::make_unique<Fitted>(train, held_out, model);
  progress(0.3, "looking for a law in what is left");
  look(*fitted, d, options);
  progress(0.5, "asking whether it is the same machine");
  const auto best = [&]() -> const Model& { return d.law ? d.law->model : fitted->model(); };
  d.disturbances = disturbances_beside(*fitted, best(), {});
  d.changed = changed_runs(fitted->all(), best());
  if (d.disturbances.empty()) return d;
  if (!d.changed.empty()) d.disturbances = disturbances_beside(*fitted, best(), d.changed);
  if (d.disturbances.empty()) return d;
  progress(0.7, "looking again without disturbances");
  auto cut_train = without_disturbances(train, d.disturbances, model.input),
       cut_held_out = without_disturbances(held_out, d.disturbances, model.input);
  const bool enough = !cut_train.empty() && cut_held_out.empty() == held_out.empty();
  if (!enough) return d;
  d.with_disturbances = WithDisturbances{d.train, d.held_out, d.law};
  fitted = std::make_unique<Fitted>(cut_train, cut_held_out, model);
  look(*fitted, d, options);
  d.changed = changed_runs(fitted->all(), best());
  d.train_runs = std::move(cut_train);
  d.held_out_runs = std::move(cut_held_out);
  progress(1, "done");
  return d;
}

}  // namespace emtb
