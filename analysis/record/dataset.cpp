#include "analysis/record/dataset.h"

#include <algorithm>

#include "analysis/numerics/even_series.h"
#include "analysis/numerics/parallel.h"
#include "analysis/record/shaft_angle.h"
#include "analysis/record/weights.h"

namespace emtb {
namespace {

std::vector<Record> weighed_all(std::span<ObservedRun> runs, const Noise& noise, const Model& model) {
  std::vector<Record> records;
  for (ObservedRun& run : runs) records.push_back(weighed(std::move(run), noise, model));
  return records;
}

}  // namespace

std::vector<Record> Dataset::all() const {
  std::vector<Record> records = train;
  records.insert(records.end(), held_out.begin(), held_out.end());
  return records;
}

double Dataset::interval() const { return mean_interval(train.front().excitation.t); }

void set_timing(std::span<Record> records, const Timing& timing) {
  for (Record& record : records) {
    record.excitation.acts_after = timing.acts_after;
    record.excitation.e_a_held = timing.held;
    for (Observation& o : record.observations) {
      const auto late = timing.late.find(o.signal);
      o.late = late != timing.late.end() && !o.slow ? late->second : 0;
    }
  }
}

void set_timing(Dataset& data, const Timing& timing) {
  data.timing = timing;
  set_timing(data.train, timing);
  set_timing(data.held_out, timing);
}

Dataset prepare(std::span<const Run> train, std::span<const Run> held_out, const Model& model, Chaining chaining) {
  Dataset data;
  const std::optional<double> order = data.ripple_order = ripple_order(train);
  std::vector<ObservedRun> observed(train.size() + held_out.size());
  parallel_for(observed.size(), [&](std::size_t i) {
    if (i < train.size()) {
      observed[i] = observe_run(train[i], model, chaining, order);
    } else {
      const Run& run = held_out[i - train.size()];
      observed[i] = order ? observe_run(run, model, chaining, order) : observe_run(run, model, chaining);
    }
  });
  data.noise = estimate_noise(observed, model);
  data.train = weighed_all(std::span(observed).first(train.size()), data.noise, model);
  data.held_out = weighed_all(std::span(observed).subspan(train.size()), data.noise, model);
  return data;
}

std::vector<Record> prepare_with(const Noise& noise, std::span<const Run> runs, const Model& model, Chaining chaining,
                                 std::optional<double> order) {
  std::vector<ObservedRun> observed;
  for (const Run& run : runs) observed.push_back(observe_run(run, model, chaining, order));
  return weighed_all(observed, noise, model);
}

Record prepare_with(const Noise& noise, const Run& run, const Model& model, Chaining chaining) {
  return weighed(observe_run(run, model, chaining), noise, model);
}

}  // namespace emtb
