#include "analysis/discover/discover.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "analysis/diagnose/remainder.h"
#include "analysis/diagnose/told_from_nothing.h"
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

/// For a law that somebody asks for, what comes again is enough, however little of the motion it is.
constexpr Materiality asked_for{.remainder_share = 0, .again = 0};

/// A model on runs, before anything is looked for.
class Fitted {
 public:
  Fitted(std::span<const Run> train, std::span<const Run> held_out, const Model& model)
      : data_(prepare(train, held_out, model)),
        given_(without_pins(model)),
        criterion_(Materiality{}),
        trials_(data_, given_, criterion_, score_, 8),
        base_(fitted_base(trials_, data_, given_)),
        worth_a_name_(emtb::worth_a_name(data_, base_.model(), base_.held_out, {}, asked_for)),
        confirms_(std::ranges::min_element(data_.held_out, {}, &Record::length) - data_.held_out.begin()) {
    set_aside();
    if (confirm_.empty()) return;
    if (auto again = trials_.fit(base_.model(), nullptr)) base_ = std::move(*again);
  }
  Fitted(const Fitted&) = delete;
  Fitted& operator=(const Fitted&) = delete;

  const Model& model() const { return base_.model(); }
  const Dataset& data() const { return data_; }
  const Trial& base() const { return base_; }
  std::span<const Record> all() const { return all_; }  ///< in the order of the runs, those that judge at the end
  std::size_t confirmed_by() const { return confirm_.size(); }
  /// On all runs that judge, those that confirm among them.
  std::map<Signal, double> held_out_squares() const {
    if (!confirm_.empty()) return squares_on_held_out(data_, confirm_, model());
    std::map<Signal, double> squares;
    for (const Signal signal : base_.held_out.signals()) squares[signal] = base_.held_out.mean_square(signal);
    return squares;
  }
  bool worth_a_name() const { return worth_a_name_; }

  /// How the runs begin, and the model as given fitted to them so.
  struct Begun {
    std::vector<InitialState> starts;  ///< of all()
    Trial base;
  };

  /// Tells the states in which the runs begin by a model that lacks less: what is missing bends those, too.
  /// @return how they began before, where any is another now
  std::optional<Begun> settles_starts(const Model& with_law) {
    Begun before{starts(), base_};
    put_back();
    const bool others = settle_starts(data_, with_law);
    set_aside();
    if (!others) return {};
    if (auto again = trials_.fit(base_.model(), nullptr)) base_ = std::move(*again);
    return before;
  }

  /// Takes back how they began.
  void begin_at(Begun before) {
    base_ = std::move(before.base);
    put_back();
    auto start = before.starts.begin();
    for (std::vector<Record>* runs : {&data_.train, &data_.held_out}) {
      for (Record& record : *runs) record.excitation.initial = *start++;
    }
    set_aside();
  }
  bool judged_on_training() const { return data_.held_out.empty() && data_.train.size() == 1; }

  std::optional<Law> law(const WhatIsLeft& left, const Shares& torque, const Shares& voltage,
                         const ReadFormula& read) const {
    if (!worth_a_name_ || judged_on_training()) return {};
    return find_law(data_, base_, given_, criterion_, confirm_, left, torque, voltage, read);
  }

 private:
  std::vector<InitialState> starts() const {
    std::vector<InitialState> all;
    for (const Record& record : all_) all.push_back(record.excitation.initial);
    return all;
  }

  /// The run that confirms, where two or more judge; all of them as they are now.
  void set_aside() {
    const RecordRefs all = data_.all();
    all_.assign(all.begin(), all.end());
    if (data_.held_out.size() < 2) return;
    confirm_.push_back(std::move(data_.held_out[static_cast<std::size_t>(confirms_)]));
    data_.held_out.erase(data_.held_out.begin() + confirms_);
  }

  void put_back() {
    if (!confirm_.empty()) data_.held_out.insert(data_.held_out.begin() + confirms_, std::move(confirm_.front()));
    confirm_.clear();
  }

  Dataset data_;
  Model given_;
  MaterialityCriterion criterion_;
  ScoreOptions score_;
  FittedTrials trials_;
  Trial base_;
  bool worth_a_name_ = false;
  std::vector<Record> all_, confirm_;
  std::ptrdiff_t confirms_;  ///< place of the shortest among those held out
};

/// The model of one run of those that changed.
void set(Model& model, const Changed& c, std::size_t place_of_run) {
  const auto at = static_cast<double>(place_of_run) / static_cast<double>(std::max<std::size_t>(1, c.runs.size() - 1));
  change_to(model, c.parameter, c.how == ChangeOf::drift ? c.from + at * (c.to - c.from) : c.to);
}

void look_once(const Fitted& fitted, Discovery& d, const DiscoverOptions& options) {
  d.worth_a_name = fitted.worth_a_name();
  d.confirmed_by = fitted.confirmed_by();
  d.judged_on_training = fitted.judged_on_training();
  d.fitted = with_standard_errors(fitted.data().train, fitted.model()).model;
  d.train = fitted.base().train;
  const std::map<Signal, double> squares = fitted.held_out_squares();
  d.held_out = error_of(squares);
  for (const auto& [signal, square] : squares) {
    d.rmse[signal] = std::sqrt(square) * fitted.data().noise.at(signal).sigma;
  }
  d.left = what_is_left(fitted.data().train, fitted.model());
  d.torque = shares_of(d.left, false);
  d.voltage = d.left.voltage_seen ? shares_of(d.left, true) : Shares{};
  d.law = fitted.law(d.left, d.torque, d.voltage, options.read);
}

void look(Fitted& fitted, Discovery& d, const DiscoverOptions& options) {
  look_once(fitted, d, options);
  if (!d.law) return;
  std::optional<Fitted::Begun> before = fitted.settles_starts(d.law->model);
  if (!before) return;
  Discovery again;
  look_once(fitted, again, options);
  if (again.law && again.law->held_out_after < d.law->held_out_after) {
    again.train_runs = std::move(d.train_runs);
    again.held_out_runs = std::move(d.held_out_runs);
    d = std::move(again);
  } else {
    fitted.begin_at(std::move(*before));
  }
}

/// The model of each run, with the values that runs of another machine have of their own: the model of all has bent to
/// them.
std::vector<Model> models_of(std::span<const Record> runs, const Model& model, std::span<const Changed> changed) {
  std::vector<Model> models(runs.size(), changed.empty() ? model : changed.back().others);
  for (const Changed& c : changed) {
    for (std::size_t r = 0; r < runs.size(); ++r) {
      if (std::ranges::find(c.runs, runs[r].name) != c.runs.end()) set(models[r], c, r);
    }
  }
  return models;
}

/// Of the runs that a disturbance acted on, or of what a cut left of them.
double mean_square_of_disturbed(std::span<const Record> runs, std::span<const Model> models,
                                std::span<const Disturbance> disturbances) {
  double squares = 0, readings = 0;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const auto acts = [&](const Disturbance& d) { return is_of_disturbed_run(runs[r].name, d); };
    if (std::ranges::none_of(disturbances, acts)) continue;
    const std::vector<Residuals> left = residuals(runs.subspan(r, 1), models[r], models[r].values(), {});
    squares += sum_of_squares(left);
    for (const Residuals& one : left) readings += static_cast<double>(one.value.size());
  }
  return readings > 0 ? squares / readings : 0;
}

/// What a cut left, and what is said of it.
struct Undisturbed {
  Discovery d;
  double mean_square = 0;
};

/// None where too little is left.
std::optional<Undisturbed> without(std::span<const Disturbance> disturbances, std::span<const Run> train,
                                   std::span<const Run> held_out, const Model& model, const DiscoverOptions& options) {
  Undisturbed u;
  u.d.train_runs = without_disturbances(train, disturbances, model.input);
  u.d.held_out_runs = without_disturbances(held_out, disturbances, model.input);
  if (u.d.train_runs.empty() || u.d.held_out_runs.empty() != held_out.empty()) return {};
  Fitted fitted(u.d.train_runs, u.d.held_out_runs, model);
  look(fitted, u.d, options);
  const Model best = u.d.law ? u.d.law->model : fitted.model();
  u.d.changed = changed_runs(fitted.all(), best);
  u.mean_square = mean_square_of_disturbed(fitted.all(), models_of(fitted.all(), best, u.d.changed), disturbances);
  return u;
}

/// Is a piece of a disturbed run still another machine?
bool says_of_disturbed(std::span<const Changed> changed, std::span<const Disturbance> disturbances) {
  return std::ranges::any_of(changed, [&](const Changed& c) {
    return std::ranges::any_of(c.runs, [&](const std::string& piece) {
      return std::ranges::any_of(disturbances, [&](const Disturbance& d) { return is_of_disturbed_run(piece, d); });
    });
  });
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
  Fitted fitted(train, held_out, model);
  progress(0.3, "looking for a law in what is left");
  look(fitted, d, options);
  progress(0.5, "asking whether it is the same machine");
  const Model best = d.law ? d.law->model : fitted.model();
  d.changed = changed_runs(fitted.all(), best);
  d.disturbances = disturbances_in(what_is_left(fitted.all(), best));
  if (d.disturbances.empty()) return d;
  progress(0.7, "looking again without disturbances");
  std::optional<Undisturbed> undisturbed = without(d.disturbances, train, held_out, model, options);
  if (!d.changed.empty()) {
    // What acts for a while bends a value of its run, and a value of its own looks like a torque where it shows most.
    constexpr double as_well = 1.2;
    const std::vector<Model> models = models_of(fitted.all(), best, d.changed);
    const double by_values = mean_square_of_disturbed(fitted.all(), models, d.disturbances);
    const std::vector<Disturbance> beside = disturbances_in(what_is_left(fitted.all(), models));
    const bool values_do = beside.empty() && (!undisturbed || by_values < as_well * undisturbed->mean_square);
    if (values_do) d.disturbances.clear();
    if (d.disturbances.empty()) return d;
    if (!beside.empty() && (!undisturbed || says_of_disturbed(undisturbed->d.changed, d.disturbances))) {
      d.disturbances = beside;
      undisturbed = without(beside, train, held_out, model, options);
    }
  }
  if (undisturbed) {
    undisturbed->d.with_disturbances = WithDisturbances{d.train, d.held_out, d.law};
    undisturbed->d.disturbances = std::move(d.disturbances);
    d = std::move(undisturbed->d);
  }
  progress(1, "done");
  return d;
}

}  // namespace emtb
