#include "analysis/diagnose/compare.h"

#include <algorithm>
#include <cmath>

#include "analysis/fit/residuals.h"
#include "analysis/numerics/parallel.h"
#include "analysis/record/shaft_angle.h"
#include "hal/error.h"

namespace emtb {

std::vector<PreparedRun> Dataset::all() const {
  std::vector<PreparedRun> records = train;
  records.insert(records.end(), held_out.begin(), held_out.end());
  return records;
}

Dataset prepare(std::span<const Run> train, std::span<const Run> held_out, const Model& model, Chaining chaining) {
  Dataset data;
  data.train.resize(train.size());
  data.held_out.resize(held_out.size());
  const std::optional<double> order = data.ripple_order = ripple_order(train);
  parallel_for(train.size() + held_out.size(), [&](std::size_t i) {
    if (i < train.size()) {
      data.train[i] = prepare_run(train[i], model, chaining, order);
    } else {
      const Run& run = held_out[i - train.size()];
      data.held_out[i - train.size()] =
          order ? prepare_run(run, model, chaining, order) : prepare_run(run, model, chaining);
    }
  });
  data.noise = estimate_noise(data.all(), model);
  weigh(data.train, data.noise, model);
  weigh(data.held_out, data.noise, model);
  return data;
}

std::map<Signal, SignalFit> fit_of(std::span<const PreparedRun> records, const Model& model, const Noise& noise) {
  struct Sums {
    double squares = 0, scaled = 0, value = 0, value_squares = 0, count = 0;
  };
  std::map<Signal, Sums> sums;
  for (const Residuals& r : residuals(records, model, model.values(), {})) {
    const Observation& o = *std::ranges::find(records[r.record].observations, r.signal, &Observation::signal);
    Sums& s = sums[r.signal];
    for (std::size_t i = 0; i < o.size(); ++i) {
      const double scaled = r.value[static_cast<Eigen::Index>(i)];
      s.squares += std::pow(scaled * o.sigma[i], 2);
      s.scaled += scaled * scaled;
      s.value += o.value[i];
      s.value_squares += o.value[i] * o.value[i];
      s.count += 1;
    }
  }
  std::map<Signal, SignalFit> fits;
  for (const auto& [signal, s] : sums) {
    const double spread = s.value_squares - s.value * s.value / s.count;
    fits[signal] = {noise.at(signal), std::sqrt(s.squares / s.count), std::sqrt(s.scaled / s.count),
                    spread > 0 ? 100 * (1 - std::sqrt(s.squares / spread)) : 0};
  }
  return fits;
}

Comparison compare(std::span<const Run> runs, const Model& model, const Model& judge) {
  if (model.input != judge.input) {
    throw ModelError("models `" + judge.name + "` and `" + model.name + "` are driven by different inputs, " +
                     std::string(info(judge.input).name) + " and " + std::string(info(model.input).name) +
                     ": their errors cannot be compared");
  }
  Comparison result;
  const Dataset staged = prepare(runs, {}, judge, Chaining::staged);
  const auto staged_squares = mean_squares(residuals(staged.train, model, model.values(), {}));
  result.error = error_of(staged_squares);
  result.signals = fit_of(staged.train, model, staged.noise);
  Dataset chained;
  for (const Run& run : runs) {
    chained.train.push_back(prepare_run(run, judge, Chaining::chained, staged.ripple_order));
  }
  weigh(chained.train, staged.noise, judge);
  const auto chained_squares = mean_squares(residuals(chained.train, model, model.values(), {}));
  result.chained_error = error_of(chained_squares);
  for (const auto& [signal, square] : chained_squares) result.chained[signal] = std::sqrt(square);
  double worst = 1.1;  // ten per cent above the floor is where a unit starts to fail
  for (const auto& [signal, square] : staged_squares) {
    if (std::sqrt(square) <= worst) continue;
    worst = std::sqrt(square);
    result.failing_unit = signal == Signal::e_a ? "driver" : signal == Signal::torque ? "load" : "motor";
  }
  result.where = residual_maps(staged.train, model);
  return result;
}

}  // namespace emtb
