#include "tests/blind/wide/oracle.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "analysis/fit/calibrate.h"
#include "analysis/fit/residuals.h"
#include "analysis/fit/starts.h"
#include "analysis/fit/timing.h"
#include "analysis/record/dataset.h"
#include "config/model.h"
#include "model/catalogue.h"
#include "session/spec.h"

namespace emtb::blind::wide {
namespace {

std::vector<Run> read_all(const CaseFiles& files, const std::vector<std::string>& names) {
  std::vector<Run> runs;
  for (const std::string& name : names) {
    for (Run& run : read_runs((files.folder / name).string())) runs.push_back(std::move(run));
  }
  return runs;
}

/// Residuals of each signal over all records, one after another.
using Errors = std::map<Signal, std::vector<double>>;

Errors errors_of(std::span<const Record> records, const Model& model) {
  Errors errors;
  for (const Residuals& r : residuals(records, model, model.values(), {})) {
    auto& list = errors[r.signal];
    list.insert(list.end(), r.value.begin(), r.value.end());
  }
  return errors;
}

double mean_square(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v * v;
  return sum / static_cast<double>(std::max<std::size_t>(values.size(), 1));
}

/// How many independent readings a series is worth: n/(1 + 2 sum of its autocorrelation while that is positive).
double effective(const std::vector<double>& values) {
  const std::size_t n = values.size();
  const double square = mean_square(values);
  if (n < 3 || square == 0) return static_cast<double>(n);
  double sum = 0;
  for (std::size_t lag = 1; lag < n / 4; ++lag) {
    double product = 0;
    for (std::size_t k = lag; k < n; ++k) product += values[k] * values[k - lag];
    const double correlation = product / static_cast<double>(n - lag) / square;
    if (correlation < 0.05) break;
    sum += correlation;
  }
  return static_cast<double>(n) / (1 + 2 * sum);
}

/// Values of parameters to begin with, by effect.
using Starts = std::map<std::string, std::vector<TrueParameter>>;

/// Those of the truth: as the plant has them, or nearly so where its law is another.
Starts true_starts(const WideCase& c) {
  Starts starts;
  for (std::size_t t = 0; t < c.truths.size(); ++t) starts[c.truths[t].id] = c.about.at(t);
  const auto& plant = c.bench.plant;
  if (starts.contains("cogging")) starts["cogging"].push_back({"N", plant.shaft.cogging_order});
  if (starts.contains("tacho_ripple")) starts["tacho_ripple"].push_back({"N", plant.sensors.ripple_order});
  return starts;
}

/// Those that the diagnosis ended with; none where its model cannot be read.
Starts found_starts(const CaseFiles& files) try {
  Starts starts;
  const Model found = read_model(files.folder / "final.yaml");
  for (const IncludedEffect& e : found.effects) {
    for (const Parameter& p : e.parameters) {
      starts[std::string(effect_catalogue()[e.effect].id)].push_back({p.symbol, p.value});
    }
  }
  return starts;
} catch (const std::exception&) {
  return {};
}

/// A structure fitted from values that are as near to the truth as anybody knows.
std::optional<Fit> fitted(std::span<const Record> train, Model model, const WideCase& c,
                          const std::vector<std::string>& ids, const Starts& starts) {
  for (const auto& [symbol, value] : true_base(c)) {
    const auto p = std::ranges::find(model.base, symbol, &Parameter::symbol);
    if (p != model.base.end()) p->value = std::clamp(value, p->min, p->max);
  }
  for (const std::string& id : ids) {
    const std::size_t effect = effect_index(id);
    if (!model.includes(effect)) model.include(effect);
    const auto known = starts.find(id);
    if (known == starts.end()) continue;
    for (Parameter& p : model.parameters_of(effect)) {
      const auto value = std::ranges::find(known->second, p.symbol, &TrueParameter::symbol);
      if (value != known->second.end()) p.value = std::clamp(value->value, p.min, p.max);
    }
  }
  Fit fit = fit_or_none(train, model, {.extra_starts = 2, .max_iterations = 60, .with_covariance = false});
  if (!std::isfinite(fit.cost)) return std::nullopt;
  return fit;
}

/// The better of two fits of one structure, from either start.
std::optional<Fit> best_fit(std::span<const Record> train, const Model& model, const WideCase& c,
                            const std::vector<std::string>& ids, const Starts& one, const Starts& other) {
  auto a = fitted(train, model, c, ids, one), b = fitted(train, model, c, ids, other);
  return !a || (b && b->cost < a->cost) ? b : a;
}

std::string joined(const std::vector<std::string>& ids) {
  std::string out;
  for (const std::string& id : ids) out += (out.empty() ? "" : " + ") + id;
  return out.empty() ? "nothing" : out;
}

/// All sets of at most `most` of the names that are not the truth; none larger than the truth itself.
std::vector<std::vector<std::string>> rivals(const std::vector<std::string>& named, const std::vector<Truth>& truths) {
  std::vector<std::vector<std::string>> sets;
  const std::size_t count = std::min<std::size_t>(named.size(), 6);
  for (std::size_t mask = 0; mask < (std::size_t{1} << count); ++mask) {
    std::vector<std::string> set;
    for (std::size_t i = 0; i < count; ++i) {
      if ((mask >> i & 1U) != 0) set.push_back(named[i]);
    }
    if (set.size() != std::min(count, truths.size())) continue;
    const bool all_true =
        set.size() == truths.size() && std::ranges::all_of(truths, [&](const Truth& t) {
          return std::ranges::any_of(t.right, [&](const auto& id) { return std::ranges::find(set, id) != set.end(); });
        });
    if (!all_true) sets.push_back(std::move(set));
  }
  return sets;
}

/// Weighed as the instruments are, whatever a diagnosis took them for. The floor of a speed from counts is the
/// library's, and the torque's, which is an input for most.
Model with_true_noise(Model model, const WideCase& c) {
  for (const Instrument& i : c.bench.instruments) {
    if (i.signal != Signal::torque) model.noise[i.signal] = i.sigma();
  }
  return model;
}

Oracle compare(const WideCase& c, const CaseFiles& files, const std::vector<std::string>& named) {
  const Model start = with_true_noise(read_model(files.folder / files.model), c);
  std::vector<std::string> judges = files.held_out;
  judges.insert(judges.end(), files.secret.begin(), files.secret.end());
  Dataset data = prepare(read_all(files, files.train), read_all(files, judges), start);
  std::vector<std::string> truth;
  for (const Truth& t : c.truths) truth.push_back(t.id);
  const Starts known = true_starts(c), found = found_starts(files);
  Starts mixed = known;
  for (const auto& [id, values] : found) mixed[id] = values;
  const auto fit_truth = [&] { return best_fit(data.train, start, c, truth, known, mixed); };
  auto true_fit = fit_truth();
  // When the readings of a row are taken, the true structure tells best; all are compared at that.
  if (true_fit && settle_timing(data, true_fit->model) != TimingChange::none) true_fit = fit_truth();
  if (true_fit && settle_starts(data, true_fit->model)) true_fit = fit_truth();
  if (!true_fit)
    return {.nats = {}, .rival = {}, .truth_error = 0, .why_not = "the true structure could not be fitted"};
  const Errors true_errors = errors_of(data.held_out, true_fit->model);
  Oracle oracle;
  for (const auto& [signal, errors] : true_errors) {
    if (signal != Signal::torque) oracle.truth_error = std::max(oracle.truth_error, std::sqrt(mean_square(errors)));
  }
  for (const auto& set : rivals(named, c.truths)) {
    const auto rival = best_fit(data.train, start, c, set, found, known);
    if (!rival) continue;
    double nats = 0;
    for (const auto& [signal, errors] : errors_of(data.held_out, rival->model)) {
      const auto& own = true_errors.at(signal);
      nats += 0.5 * std::min(effective(own), effective(errors)) * std::log(mean_square(errors) / mean_square(own));
    }
    if (!oracle.nats || nats < *oracle.nats) oracle.nats = nats, oracle.rival = joined(set);
  }
  return oracle;
}

}  // namespace

bool in_library(const std::string& id) {
  return std::ranges::find(effect_catalogue(), id, &EffectInfo::id) != effect_catalogue().end();
}

Oracle ask_oracle(const WideCase& c, const CaseFiles& files, const std::vector<std::string>& named) {
  for (const Truth& t : c.truths) {
    if (!in_library(t.id)) return {.nats = {}, .rival = {}, .truth_error = 0, .why_not = "the library lacks " + t.id};
  }
  for (const std::string& id : named) {
    if (!in_library(id))
      return {.nats = {}, .rival = {}, .truth_error = 0, .why_not = id + " is no effect of this library"};
  }
  try {
    return compare(c, files, named);
  } catch (const std::exception& error) {
    return {.nats = {}, .rival = {}, .truth_error = 0, .why_not = error.what()};
  }
}

std::map<std::string, double> secret_errors(const WideCase& c, const CaseFiles& files, const std::string& model) {
  const Model final = with_true_noise(read_model(files.folder / model), c);
  Dataset data = prepare(read_all(files, files.train), read_all(files, files.secret), final);
  settle_timing(data, final);
  settle_starts(data, final);
  std::map<std::string, double> out;
  for (const auto& [signal, errors] : errors_of(data.held_out, final)) {
    if (signal == Signal::torque) continue;  // an input, unless the model has a load
    out[std::string(info(signal).name)] = std::sqrt(mean_square(errors));
  }
  return out;
}

}  // namespace emtb::blind::wide
