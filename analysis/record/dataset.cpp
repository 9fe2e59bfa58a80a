#include "analysis/record/dataset.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "analysis/numerics/even_series.h"
#include "analysis/numerics/parallel.h"
#include "analysis/record/angle_noise.h"
#include "analysis/record/counted_speed.h"
#include "analysis/record/reference_row.h"
#include "analysis/record/shaft_angle.h"
#include "analysis/record/terminal_lateness.h"
#include "analysis/record/voltage_noise.h"
#include "analysis/record/weights.h"
#include "session/resolution.h"

namespace emtb {
namespace {

std::vector<Record> weighed_all(std::span<ObservedRun> runs, const Noise& noise, const Model& model) {
  std::vector<Record> records;
  for (ObservedRun& run : runs) records.push_back(weighed(std::move(run), noise, model));
  return records;
}

/// The runs, with the readings of the terminals so many rows earlier.
std::vector<Run> with_voltage_earlier(std::span<const Run> runs, int rows, const Model& model) {
  std::vector<Run> earlier(runs.begin(), runs.end());
  for (Run& run : earlier) {
    if (!run.has(Signal::e_a) || !run.has(model.input)) continue;
    Series& e_a = run.signals[Signal::e_a];
    const double by = rows * mean_interval(e_a.t);
    const std::span<double> value = e_a.value.edit();
    for (std::size_t k = 0; k < e_a.t.size(); ++k) {
      const std::size_t from = std::min(k + static_cast<std::size_t>(rows), e_a.t.size() - 1);
      if (std::abs(e_a.t[from] - e_a.t[k] - by) < 0.5 * by) value[k] = value[from];
    }
  }
  return earlier;
}

/// Of each signal, the step that all runs agree on that know one.
std::map<Signal, double> agreed_steps(std::span<const Run> train, std::span<const Run> held_out) {
  constexpr double same = 1e-3;
  std::map<Signal, double> steps;
  for (const std::span<const Run> runs : {train, held_out}) {
    for (const Run& run : runs) {
      for (const auto& [signal, series] : run.signals) {
        if (series.lsb <= 0) continue;
        double& step = steps.try_emplace(signal, series.lsb).first->second;
        if (std::abs(series.lsb - step) > same * step) step = 0;
      }
    }
  }
  return steps;
}

/// Runs too short to tell the step of an instrument have that of the others. Empty: all know it.
std::vector<Run> with_steps(std::span<const Run> runs, const std::map<Signal, double>& steps) {
  std::vector<Run> all;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    for (const auto& [signal, step] : steps) {
      if (step <= 0 || !runs[i].has(signal) || runs[i].at(signal).lsb > 0) continue;
      if (!lies_on_grid(runs[i].at(signal).value, step)) continue;
      if (all.empty()) all.assign(runs.begin(), runs.end());
      all[i].signals.at(signal).lsb = step;
    }
  }
  return all;
}

/// An instrument is behind by a time: the part of each row that this is, where the rows are not alike; empty where they
/// are.
std::vector<double> late_by_row(double late, std::span<const double> t) {
  constexpr double alike = 0.02;
  if (late <= 0 || t.size() < 2) return {};
  const double interval = mean_interval(t);
  const auto rows_at = [&](std::size_t k) { return (t[k] - t[k - 1]) / interval; };
  std::size_t first = 1;  // that differs: most loggers' rows do not, and a search for timing asks often
  while (first < t.size() && std::abs(rows_at(first) - 1) < alike) ++first;
  if (first == t.size()) return {};
  std::vector<double> parts(t.size(), late);
  for (std::size_t k = 1; k < t.size(); ++k) {
    const double rows = rows_at(k);
    parts[k] = rows > 0 ? std::min(1.0, late / rows) : 1;
  }
  return parts;
}

/// Does an instrument average over so few rows that what the signal does within one of them shows?
bool averages_over_few_rows(const Observation& o) {
  constexpr std::uint32_t few = 10;
  if (o.functional != Functional::mean || o.at_once || o.size() == 0) return false;
  const std::size_t middle = o.size() / 2;  // readings are alike
  return o.last[middle] - o.first[middle] <= few;
}

}  // namespace

bool may_read_at_once(const Observation& o) { return o.slow && o.window <= 0 && o.functional == Functional::mean; }

RecordRefs Dataset::all() const {
  RecordRefs records(train.begin(), train.end());
  records.insert(records.end(), held_out.begin(), held_out.end());
  return records;
}

double Dataset::interval() const { return mean_interval(train.front().excitation.t); }

void set_timing(std::span<Record> records, const Timing& timing) {
  for (Record& record : records) {
    record.lags_in_itself = timing.lags_in_itself;
    record.excitation.acts_after = timing.acts_after;
    record.excitation.e_a_held = timing.held;
    record.excitation.rows_early = timing.rows_early;
    record.excitation.reads_circuit_late = record.excitation.reads_shaft_late = false;
    for (Observation& o : record.observations) o.at_once = timing.meters_at_once && may_read_at_once(o);
    record.excitation.reads_means = std::ranges::any_of(record.observations, averages_over_few_rows);
    for (Observation& o : record.observations) {
      const auto late = timing.late.find(o.signal);
      const bool told_by_runs = o.signal == Signal::e_a && late == timing.late.end();
      const double by_window = o.late_by_window(mean_interval(record.excitation.t));
      if (!told_by_runs) o.late = late == timing.late.end() ? by_window : !o.slow ? late->second : 0;
      o.late_by_row = late_by_row(o.late, record.excitation.t);
      if (o.late > 0 && o.signal != Signal::e_a && o.signal != Signal::torque)
        record.excitation.reads_shaft_late = true;
      const bool moves = !record.excitation.u_ref.empty() || timing.held;
      if ((o.signal == Signal::i_a || o.signal == Signal::e_a) && o.late > 0 && moves)
        record.excitation.reads_circuit_late = true;
    }
  }
}

void set_timing(Dataset& data, const Timing& timing) {
  data.timing = timing;
  set_timing(data.train, timing);
  set_timing(data.held_out, timing);
}

void set_noise(Dataset& data, Noise noise, const Model& model) {
  data.noise = std::move(noise);
  for (auto* records : {&data.train, &data.held_out}) {
    for (Record& record : *records) record = weighed(ObservedRun(std::move(record)), data.noise, model);
  }
  set_timing(data, data.timing);
}

namespace {

constexpr double alike = 1.5;  // of steps in a row: a time constant is seldom known better before it is fitted

double steps_in(double interval, double step) { return std::max(1.0, interval / step); }

/// Does another step divide a row into clearly more?
bool is_finer(double interval, double before, double now) {
  return steps_in(interval, now) > alike * steps_in(interval, before);
}

/// Sets the steps of a model in all records in which `asked(interval, before, now)` says so of one of them.
template <class Asked>
bool set_steps_where(Dataset& data, const Model& fitted, const Asked& asked) {
  Excitation fit;
  set_steps(fit, fitted);
  bool changed = false;
  for (auto* records : {&data.train, &data.held_out}) {
    for (Record& record : *records) {
      Excitation& x = record.excitation;
      const double interval = mean_interval(x.t);
      if (!asked(interval, x.longest_step, fit.longest_step) && !asked(interval, x.quick_step, fit.quick_step))
        continue;
      x.longest_step = fit.longest_step;
      x.quick_step = fit.quick_step;
      changed = true;
    }
  }
  return changed;
}

}  // namespace

bool set_steps(Dataset& data, const Model& fitted) {
  return set_steps_where(data, fitted, [](double interval, double before, double now) {
    return is_finer(interval, before, now) || is_finer(interval, now, before);
  });
}

bool set_shorter_steps(Dataset& data, const Model& fitted) { return set_steps_where(data, fitted, is_finer); }

namespace {

/// As the readings tell, but where the model's bench says that a tachogenerator reads the speed.
std::optional<CountedSpeed> counted_speed_of(const Model& model, std::span<const Run> runs,
                                             std::span<const Run> others = {}) {
  if (model.bench.tachogenerator.value_or(false)) return std::nullopt;
  return counted_speed(runs, others);
}

}  // namespace

Dataset prepare(std::span<const Run> train_as_read, std::span<const Run> held_out_as_read, const Model& model,
                Chaining chaining) {
  Dataset data;
  std::span<const Run> train = train_as_read, held_out = held_out_as_read;
  std::vector<Run> trains_with_steps, held_out_with_steps, trains_counted, held_out_counted, trains_earlier,
      held_out_earlier;
  const std::map<Signal, double> steps = agreed_steps(train, held_out);
  if (trains_with_steps = with_steps(train, steps); !trains_with_steps.empty()) train = trains_with_steps;
  if (held_out_with_steps = with_steps(held_out, steps); !held_out_with_steps.empty()) held_out = held_out_with_steps;
  if (const auto counted = counted_speed_of(model, train, held_out)) {
    train = trains_counted = with_counted_angle(train, *counted);
    held_out = held_out_counted = with_counted_angle(held_out, *counted);
  }
  data.timing.voltage_late = rows_voltage_is_late(train, model);
  if (data.timing.voltage_late > 0) {
    train = trains_earlier = with_voltage_earlier(train, data.timing.voltage_late, model);
    held_out = held_out_earlier = with_voltage_earlier(held_out, data.timing.voltage_late, model);
  }
  const std::optional<double> order = data.ripple_order = ripple_order(train);
  double voltage_late = 0;
  if (chaining == Chaining::staged) {
    const double as_terminals_tell = reference_acts_after(train, model);
    voltage_late = terminals_are_late(train, model, as_terminals_tell);
    const double early = voltage_late > 0 ? voltage_late : edges_come_early(train, model, as_terminals_tell);
    data.timing.acts_after = as_terminals_tell;
    if (early > 0) data.timing.acts_after -= early * mean_interval(train.front().at(model.input).t);
  }
  const Logging logging{.order = order,
                        .acts_after = data.timing.acts_after,
                        .voltage_late = voltage_late,
                        .angle_noise = angle_noise(model, train, held_out),
                        .voltage_hops = voltage_hops_alone(train, model)};
  std::vector<ObservedRun> observed(train.size() + held_out.size());
  parallel_for(observed.size(), [&](std::size_t i) {
    const bool trains = i < train.size();
    const Run& run = trains ? train[i] : held_out[i - train.size()];
    Logging its_own = logging;
    if (!trains && !order) its_own.order = ripple_order(std::span(&run, 1));
    observed[i] = observe_run(run, model, chaining, its_own);
  });
  data.noise = estimate_noise(observed, model);
  data.train = weighed_all(std::span(observed).first(train.size()), data.noise, model);
  data.held_out = weighed_all(std::span(observed).subspan(train.size()), data.noise, model);
  data.effort = std::make_shared<Effort>();
  for (auto* records : {&data.train, &data.held_out}) {
    for (Record& record : *records) record.effort = data.effort;
  }
  if (voltage_late > 0) data.timing.late[Signal::e_a] = voltage_late;
  set_timing(data, data.timing);  // what the windows of instruments tell, too
  return data;
}

std::vector<Record> prepare_with(const Noise& noise, std::span<const Run> runs, const Model& model, Chaining chaining,
                                 std::optional<double> order) {
  std::vector<Run> with_angle;
  if (const auto counted = counted_speed_of(model, runs)) runs = with_angle = with_counted_angle(runs, *counted);
  std::vector<ObservedRun> observed;
  const Logging logging{
      .order = order, .angle_noise = angle_noise(model, runs), .voltage_hops = voltage_hops_alone(runs, model)};
  for (const Run& run : runs) observed.push_back(observe_run(run, model, chaining, logging));
  return weighed_all(observed, noise, model);
}

Record prepare_with(const Noise& noise, const Run& run, const Model& model, Chaining chaining) {
  return prepare_with(noise, std::span(&run, 1), model, chaining, ripple_order(std::span(&run, 1))).front();
}

}  // namespace emtb
